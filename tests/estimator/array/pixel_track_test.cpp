#include "estimator/array/pixel_track.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/pixel_field.hpp"

namespace splid::array {
namespace {

using test::PixelField;

test::FrameMaker plate() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 1.2;
  return made;
}

// Measures frame by frame as the daemon does.
class Measured {
 public:
  explicit Measured(const PixelField& field)
      : estimator_(plate().pattern, {}, {}, {}, 50, 50'000),
        neighbours_(field.directions(), 1),
        seen_(field.size()),
        estimates(field.size()),
        is_searched(field.size()) {
    for (std::size_t k = 0; k < field.size(); ++k) tracks_.emplace_back(k);
  }

  void measure(const std::vector<FrameView>& views) {
    searches = 0;
    helped = 0;
    const std::vector<TargetTrack> last = seen_;
    for (std::size_t k = 0; k < views.size(); ++k) {
      tracks_[k].begin_frame(help_of(neighbours_, k, last));
      helped += tracks_[k].track().valid && !tracks_[k].seen().valid ? 1 : 0;
      estimates[k] = estimator_.estimate(views[k], &tracks_[k].track());
      is_searched[k] = tracks_[k].track().followed == 0;
      searches += is_searched[k] ? 1 : 0;
      seen_[k] = tracks_[k].seen();
    }
  }

 private:
  FrameEstimator estimator_;
  Neighbours neighbours_;
  std::vector<PixelTrack> tracks_;
  std::vector<TargetTrack> seen_;

 public:
  std::vector<Estimate> estimates;
  std::vector<bool> is_searched;
  std::size_t searches = 0, helped = 0;
};

TEST(PixelTrack, PixelsAreSearchedAnewInTurn) {
  PixelField field(16, plate());
  Measured measured(field);
  measured.measure(field.next(1));
  EXPECT_EQ(measured.searches, 16U);
  std::vector<int> searched(16);
  for (std::uint64_t n = 2; n < 45; ++n) {
    measured.measure(field.next(n));
    EXPECT_LE(measured.searches, 2U) << n;
    for (std::size_t k = 0; k < 16; ++k) {
      EXPECT_TRUE(field.is_right(measured.estimates[k], k)) << n << " " << k;
      searched[k] += measured.is_searched[k] ? 1 : 0;
    }
  }
  for (const int count : searched) EXPECT_NEAR(count, 2, 1);
}

// A pixel that gets light begins where its neighbours see the surface, and is not searched. One
// whose surface is elsewhere is searched, and found.
TEST(PixelTrack, NeighboursHelpAPixelThatGetsLight) {
  PixelField field(16, plate());
  field.pixel(5).signal_per_pulse = 0;
  field.pixel(10).signal_per_pulse = 0;
  Measured measured(field);
  measured.measure(field.next(1));
  measured.measure(field.next(2));
  EXPECT_EQ(measured.helped, 2U);
  EXPECT_EQ(measured.estimates[5].status, FrameStatus::no_target);
  EXPECT_TRUE(measured.is_searched[5]);
  field.pixel(5).signal_per_pulse = field.pixel(6).signal_per_pulse / 2;
  field.pixel(10).signal_per_pulse = field.pixel(6).signal_per_pulse;
  field.pixel(10).distance_m += 12;
  measured.measure(field.next(3));
  EXPECT_EQ(measured.helped, 2U);
  EXPECT_TRUE(field.is_right(measured.estimates[5], 5));
  EXPECT_FALSE(measured.is_searched[5]);
  EXPECT_TRUE(field.is_right(measured.estimates[10], 10));
  EXPECT_TRUE(measured.is_searched[10]);
  measured.measure(field.next(4));
  EXPECT_EQ(measured.helped, 0U);
  EXPECT_TRUE(field.is_right(measured.estimates[5], 5));
}

TEST(PixelTrack, ADarkFieldHelpsNobody) {
  test::FrameMaker dark = plate();
  dark.signal_per_pulse = 0;
  PixelField field(4, dark);
  Measured measured(field);
  for (std::uint64_t n = 1; n < 4; ++n) {
    measured.measure(field.next(n));
    EXPECT_EQ(measured.helped, 0U);
    EXPECT_EQ(measured.searches, 4U);
  }
}

}  // namespace
}  // namespace splid::array
