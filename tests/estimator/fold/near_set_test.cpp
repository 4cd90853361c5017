#include "estimator/fold/near_set.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker near_maker() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = 5;
  made.velocity_mps = 42;
  made.drift_ppm = 17;
  return made;
}

// Photon by photon, pulse by pulse.
TEST(NearSet, HoldsEveryPhotonInTheWindowAndNoOther) {
  const auto frame = near_maker().make(3);
  const PulseTrain train(near_maker().pattern);
  const Comb& comb = train.segments.front().comb;
  FoldedFrame folded(train, frame.photons_ps.size());
  folded.fold(frame.view(), train);
  for (const DelayTrack line :
       {DelayTrack{1898, 1.4}, DelayTrack{0.1, -5}, DelayTrack{3779.95, 50}}) {
    const std::vector<CombWindow> windows = comb_windows(train, -1.5, 2.5);
    NearSet near(folded.size(), folded.size());
    near.collect(folded, windows, train, line);
    std::vector<double> expected;
    std::size_t far = 0;
    for (std::size_t i = 0; i < folded.size(); ++i) {
      bool any = false;
      for (const double time : comb.times_ns) {
        const double residual =
            std::remainder(folded.phase_ns[i] - line.delay_ns -
                               line.walk_ns * folded.time_ns[i] / folded.length_ns - time,
                           comb.period_ns);
        if (residual < -1.5 || residual > 2.5) continue;
        expected.push_back(residual);
        any = true;
      }
      far += any ? 0 : 1;
    }
    ASSERT_EQ(near.entries(), expected.size());
    EXPECT_GT(near.entries(), 10U);
    for (std::size_t j = 0; j < expected.size(); ++j) {
      ASSERT_NEAR(near.residual_ns[j], expected[j], 1e-9);
    }
    EXPECT_EQ(near.photons() + far, folded.size());
  }
}

// Cell by cell the same photons: their number and their means.
TEST(NearSet, GathersVeryManyPhotonsAtTheirMeans) {
  test::FrameMaker bright = near_maker();
  bright.signal_per_pulse = 2;
  const auto frame = bright.make(4);
  const PulseTrain train(bright.pattern);
  FoldedFrame folded(train, frame.photons_ps.size());
  folded.fold(frame.view(), train);
  const DelayTrack line = {2 * bright.distance_m / 0.299792458, 1.4};
  const double width_ns = 0.1;
  const std::vector<CombWindow> windows = comb_windows(train, -1, 1);
  NearSet all(folded.size(), folded.size());
  all.collect(folded, windows, train, line);
  NearSet gathered(folded.size(), folded.size());
  gathered.collect(folded, windows, train, line, width_ns);
  ASSERT_GT(all.photons(), 80'000U);
  EXPECT_LT(gathered.photons(), 10'000U);

  struct Sums {
    double weight = 0, residual = 0, square = 0, slant = 0;
  };
  const auto sums_of = [](const NearSet& near) {
    Sums sums;
    for (std::size_t k = 0; k < near.photons(); ++k) {
      const double r = near.residual_ns[k];
      sums.weight += near.weight[k];
      sums.residual += near.weight[k] * r;
      sums.square += near.weight[k] * r * r;
      sums.slant += near.weight[k] * r * near.position[k];
    }
    return sums;
  };
  const Sums one = sums_of(all);
  const Sums other = sums_of(gathered);
  EXPECT_EQ(other.weight, one.weight);
  EXPECT_NEAR(other.residual, one.residual, 1e-6);
  // What lies within a cell: a twelfth of its width squared, and as a covariance next to nothing.
  const double inside = one.weight * std::pow(width_ns / 8, 2) / 12;
  EXPECT_NEAR(one.square - other.square, inside, 0.1 * inside);
  EXPECT_NEAR(other.slant, one.slant, 0.1);
  EXPECT_EQ(gathered.position.size(), gathered.photons());
  EXPECT_LT(*std::max_element(gathered.position.begin(), gathered.position.end()), 0.5);
}

}  // namespace
}  // namespace splid
