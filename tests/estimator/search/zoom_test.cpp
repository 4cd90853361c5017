#include "estimator/search/zoom.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

// From a cell `reach` wide down to the pulse, for pulses of 100 ps and, over three stages, of 2 ps.
TEST(Zoom, EndsWithinAPulseOfTheTarget) {
  for (const double sigma_ns : {0.1, 0.002}) {
    test::FrameMaker made;
    made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
    made.velocity_mps = 20;
    made.sigma_ns = sigma_ns;
    const auto frame = made.make(4);
    const PulseTrain train(made.pattern);
    FoldedFrame folded(train, frame.photons_ps.size());
    folded.fold(frame.view(), train);
    const double beta = 20 / 299792458.0;
    const DelayTrack truth = {2 * made.distance_m / 0.299792458 / (1 + beta),
                              2 * beta / (1 + beta) * folded.length_ns};
    NearSet near(folded.size(), folded.size());
    for (const double off : {-1.0, -0.3, 0.0, 0.8}) {
      const double reach = 1.5;
      near.collect(folded, comb_windows(train, -2 * reach - 0.4, 2 * reach + 0.4), train,
                   {truth.delay_ns + off, truth.walk_ns - 1.7 * off});
      const DelayTrack line = Zoom(sigma_ns, 0).find(near, reach, true).line;
      EXPECT_NEAR(line.delay_ns, truth.delay_ns, 2.5 * sigma_ns) << off;
      EXPECT_NEAR(line.walk_ns, truth.walk_ns, 6 * sigma_ns) << off;
    }
  }
}

TEST(Zoom, AtRestKeepsTheTravel) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const auto frame = made.make(4);
  const PulseTrain train(made.pattern);
  FoldedFrame folded(train, frame.photons_ps.size());
  folded.fold(frame.view(), train);
  NearSet near(folded.size(), folded.size());
  const double truth = 2 * made.distance_m / 0.299792458;
  near.collect(folded, comb_windows(train, -1, 1), train, {truth + 0.2, 0});
  const DelayTrack line = Zoom(0.1, 0).find(near, 0.4, false).line;
  EXPECT_EQ(line.walk_ns, 0);
  EXPECT_NEAR(line.delay_ns, truth, 0.1);  // it began 0.2 ns away
}

}  // namespace
}  // namespace splid
