#include <gtest/gtest.h>

#include "estimator/checks/light_flicker.hpp"
#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double dead_time_ns = 50;

// Frames of 50 ms, of which two inputs get such shares.
Estimate estimate_split(double S, double first_share, std::uint64_t seed = 1) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = 50;
  made.signal_per_pulse = S;
  made.background_per_ns = 0.002;
  made.dead_time_ns = dead_time_ns;
  made.inputs = 2;
  made.first_share = first_share;
  const test::FrameMaker::Frame frame = made.make(seed);
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, frame.photons_ps.size(),
                           ClockReference::tagger, {dead_time_ns, DeadTime::modelled}, 2);
  return estimator.estimate(frame.view());
}

double deviations(const Estimate& estimate, double signal) {
  return signal / estimate.std_signal_per_pulse;
}

TEST(InputSplit, SaysByHowMuchBrightPulsesAreLow) {
  for (const auto& [S, share] : {std::pair{1.0, 0.7}, {3.0, 0.55}, {3.0, 0.7}, {0.5, 0.9}}) {
    const Estimate found = estimate_split(S, share);
    ASSERT_TRUE(found.has_values);
    const double off = deviations(found, S - found.signal_per_pulse);
    const double said = deviations(found, found.low_by_split * found.signal_per_pulse);
    // The frame's own chance is a deviation. In the brightest pulses counts understate the split.
    EXPECT_GT(said, (S > 1 ? 0.25 : 0.5) * off - 2) << S << " " << share;
    EXPECT_LT(said, 2 * off + 2) << S << " " << share;
    EXPECT_GT(said, 0.5) << S << " " << share;
  }
}

TEST(InputSplit, OfEvenSharesAndOfWeakPulsesSaysNothing) {
  for (const auto& [S, share] : {std::pair{3.0, 0.5}, {0.5, 0.5}, {0.1, 0.7}, {0.02, 0.9}}) {
    const Estimate found = estimate_split(S, share);
    EXPECT_LT(deviations(found, found.low_by_split * found.signal_per_pulse), 0.1)
        << S << " " << share;
  }
}

// Ten times the amplitudes with a tenth of the signal are the same light.
TEST(InputSplit, IsOfTheLightOfAPulseWhateverItsAmplitude) {
  Pattern pattern = test::periodic_pattern(100000);
  const std::vector<std::uint64_t> counts = {900, 100};
  Estimate estimate;
  estimate.photons = 1000;
  estimate.signal_per_pulse = 3;
  FrameView frame;
  frame.end_ps = 1'000'000'000;
  frame.photons_of_input = counts;
  const double low = low_by_split(frame, estimate, PulseTrain(pattern));
  EXPECT_GT(low, 0.01);
  for (double& amplitude : pattern.segments[0].amplitudes) amplitude *= 10;
  estimate.signal_per_pulse /= 10;
  EXPECT_NEAR(low_by_split(frame, estimate, PulseTrain(pattern)), low, 1e-12);
}

TEST(InputSplit, SaysNothingWhereTheCountsAreNotKnown) {
  Estimate estimate;
  estimate.photons = 1000;
  estimate.signal_per_pulse = 3;
  FrameView frame;
  frame.end_ps = 1'000'000'000;
  EXPECT_EQ(low_by_split(frame, estimate, PulseTrain(test::periodic_pattern(100000))), 0);
  const std::vector<std::uint64_t> counts = {900, 100};
  frame.photons_of_input = counts;
  EXPECT_GT(low_by_split(frame, estimate, PulseTrain(test::periodic_pattern(100000))), 0.01);
}

}  // namespace
}  // namespace splid
