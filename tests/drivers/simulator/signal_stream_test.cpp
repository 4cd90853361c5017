#include "drivers/simulator/signal_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

using test::one_segment;
using test::paper_pattern;

TargetOptions linear(double distance_m, double velocity_mps = 0) {
  TargetOptions options;
  options.motion = MotionKind::linear;
  options.distance_m = distance_m;
  options.velocity_mps = velocity_mps;
  return options;
}

DetectionOptions exact(double signal_per_pulse) {
  DetectionOptions options;
  options.signal_per_pulse = signal_per_pulse;
  options.sigma_ps = 0;
  return options;
}

std::vector<std::int64_t> detections(SignalStream stream, std::int64_t until_ps) {
  std::vector<std::int64_t> times;
  for (std::int64_t to_ps = until_ps / 10; to_ps <= until_ps; to_ps += until_ps / 10) {
    stream.fill(to_ps);
    for (; stream.pending().front() < to_ps; stream.pending().pop()) {
      times.push_back(stream.pending().front());
    }
  }
  return times;
}

// Mean and variance of how far behind a distance photons are sent back, each with its standard
// error, and how many there are.
struct Depths {
  double count = 0, mean_m = 0, mean_error_m = 0, variance_m2 = 0, variance_error_m2 = 0;
  double least_m = 1e9, most_m = -1e9;
};

Depths depths(const std::vector<std::int64_t>& times, double distance_m, double period_ps) {
  std::vector<double> all;
  for (const std::int64_t time : times) {
    const double way_ps = static_cast<double>(time) - 2 * distance_m / light_m_per_ps;
    all.push_back((way_ps - period_ps * std::floor(way_ps / period_ps + 1e-6)) * light_m_per_ps /
                  2);
  }
  Depths found;
  found.count = static_cast<double>(all.size());
  for (const double x : all) found.mean_m += x / found.count;
  double fourth = 0;
  for (const double x : all) {
    const double square = (x - found.mean_m) * (x - found.mean_m);
    found.variance_m2 += square / found.count;
    fourth += square * square / found.count;
    found.least_m = std::min(found.least_m, x), found.most_m = std::max(found.most_m, x);
  }
  found.mean_error_m = std::sqrt(found.variance_m2 / found.count);
  found.variance_error_m2 =
      std::sqrt((fourth - found.variance_m2 * found.variance_m2) / found.count);
  return found;
}

// A target of a depth is lit evenly: mean at half of it, variance a twelfth of its square.
TEST(SignalStream, ASlabSendsBackEvenly) {
  TargetOptions slab = linear(150);
  slab.depth_m = 0.4;
  const auto times = detections(
      SignalStream(one_segment(10'000'000, {0}, {1}), exact(0.5), {}, TargetPath(slab), 3),
      200'000'000'000);
  const Depths found = depths(times, 150, 1e7);
  EXPECT_NEAR(found.count, 1e4, 4 * 100);
  EXPECT_NEAR(found.mean_m, 0.2, 4 * found.mean_error_m);
  EXPECT_NEAR(found.variance_m2, 0.16 / 12, 4 * found.variance_error_m2);
  EXPECT_GE(found.least_m, -1e-4);
  EXPECT_LE(found.most_m, 0.4001);
}

// z exp(-z / 20 m): mean 40 m, variance 2 (20 m)^2.
TEST(SignalStream, FogSendsBackFromItsWholeDepth) {
  DetectionOptions fog = exact(0.5);
  fog.fog_m = 40;
  const auto times = detections(
      SignalStream(one_segment(10'000'000, {0}, {1}), fog, {}, TargetPath(linear(100)), 3),
      200'000'000'000);
  const Depths found = depths(times, 100, 1e7);
  EXPECT_NEAR(found.count, 1e4, 4 * 100);
  EXPECT_NEAR(found.mean_m, 40, 4 * found.mean_error_m);
  EXPECT_NEAR(found.variance_m2, 800, 4 * found.variance_error_m2);
}

// To and fro in 100 ms: of the light of 50 ms the back's share goes from none to all.
TEST(SignalStream, ABeamGoesOverAnEdge) {
  TargetOptions edge = linear(150);
  edge.depth_m = 0.05, edge.edge_period_s = 0.1;
  SignalStream stream(one_segment(1'000'000, {0}, {1}), exact(0.5), {}, TargetPath(edge), 3);
  double count[5] = {}, back[5] = {};
  for (const std::int64_t time : detections(stream, 50'000'000'000)) {
    const auto part = static_cast<std::size_t>(time / 10'000'000'000);
    const Depths one = depths({time}, 150, 1e6);
    ASSERT_TRUE(std::abs(one.mean_m) < 1e-3 || std::abs(one.mean_m - 0.05) < 1e-3) << one.mean_m;
    count[part] += 1, back[part] += one.mean_m > 0.025 ? 1 : 0;
  }
  for (std::size_t part = 0; part < 5; ++part) {
    EXPECT_NEAR(count[part], 5000, 4 * std::sqrt(5000));
    EXPECT_NEAR(back[part] / count[part], 0.1 + 0.2 * static_cast<double>(part), 4 * 0.5 / 70);
  }
}

class MovingTarget : public testing::TestWithParam<double> {};

// Every detection of a noiseless scene is at an arrival time of the closed form, in long doubles:
// (2 z0 + 2 v e) / (c - v) + e for a pulse that leaves at e.
TEST_P(MovingTarget, PhotonsArriveWhenTheClosedFormSays) {
  const double velocity_mps = GetParam();
  const double distance_m = 40'000;
  const Pattern pattern = paper_pattern();
  const auto times = detections(
      SignalStream(pattern, exact(0.01), {}, TargetPath(linear(distance_m, velocity_mps)), 11),
      200'000'000'000);
  const long double c = 299'792'458e-12L;
  const long double v = velocity_mps * 1e-12L;
  ASSERT_GT(times.size(), 15'000U);
  long double worst_ps = 0;
  for (const std::int64_t time_ps : times) {
    const long double emitted_ps = (time_ps * (c - v) - 2 * distance_m) / (c + v);
    const long double phase_ps = emitted_ps - 3'780'000 * std::floor(emitted_ps / 3'780'000);
    long double nearest_ps = 3'780'000 - phase_ps;
    for (const double pulse_ps : pattern.segments[0].pulse_times_ps) {
      nearest_ps = std::min(nearest_ps, std::abs(phase_ps - pulse_ps));
    }
    worst_ps = std::max(worst_ps, nearest_ps);
  }
  // Half a picosecond of rounding, as seen through the warp.
  EXPECT_LT(static_cast<double>(worst_ps), 0.502);
}

INSTANTIATE_TEST_SUITE_P(Speeds, MovingTarget,
                         testing::Values(0.0, 150.0, -150.0, 30'000.0, -30'000.0));

// Counts of detections in each pattern period against Poisson's probabilities.
TEST(SignalStream, CountsArePoisson) {
  constexpr double mean = 2;
  constexpr int periods = 200'000;
  const Pattern pattern = one_segment(1e6, {0, 300'000}, {1.5, 0.5});
  const auto times =
      detections(SignalStream(pattern, exact(mean / 2), {}, TargetPath(linear(10)), 5),
                 std::int64_t{periods} * 1'000'000);
  std::vector<int> counts(periods + 1);
  for (const std::int64_t time : times) ++counts[static_cast<std::size_t>(time / 1'000'000)];
  std::map<int, double> seen;
  for (int i = 0; i < periods; ++i) seen[std::min(counts[i], 8)] += 1;
  double chi = 0;
  double left = periods;
  double expected = periods * std::exp(-mean);
  for (int n = 0; n < 8; expected *= mean / ++n) {
    chi += (seen[n] - expected) * (seen[n] - expected) / expected;
    left -= expected;
  }
  chi += (seen[8] - left) * (seen[8] - left) / left;
  EXPECT_LT(chi, 26.1);  // 8 degrees of freedom, 1 in 1000
}

TEST(SignalStream, PulsesShareTheLightByAmplitude) {
  const Pattern pattern = one_segment(1e6, {0, 300'000, 600'000}, {1.5, 0, 0.5});
  const auto times =
      detections(SignalStream(pattern, exact(0.1), {}, TargetPath(linear(10)), 6), 500'000'000'000);
  std::map<std::int64_t, double> by_phase;
  for (const std::int64_t time : times) by_phase[time % 1'000'000 / 300'000] += 1;
  const double total = static_cast<double>(times.size());
  EXPECT_NEAR(total, 100'000, 4 * std::sqrt(100'000.0));
  EXPECT_NEAR(by_phase[0] / total, 0.75, 0.006);
  EXPECT_EQ(by_phase[1], 0);
}

// 200 km away, light of a hundred periods is under way when the stream starts.
TEST(SignalStream, LightOfEarlierPulsesIsThereFromTheStart) {
  const auto times = detections(
      SignalStream(paper_pattern(), exact(1), {}, TargetPath(linear(200'000)), 7), 100'000'000);
  ASSERT_FALSE(times.empty());
  EXPECT_LT(times.front(), 2'000'000);
  const auto half = std::lower_bound(times.begin(), times.end(), 50'000'000) - times.begin();
  const double share = static_cast<double>(half) / static_cast<double>(times.size());
  EXPECT_NEAR(share, 0.5, 4 * 0.5 / std::sqrt(static_cast<double>(times.size())));
}

TEST(SignalStream, JitterTailAndDelayShowInTheArrivals) {
  DetectionOptions options = exact(0.5);
  options.sigma_ps = 200;
  options.tail_fraction = 0.5;
  options.tail_ps = 1000;
  options.emission_jitter_ps = 100;
  options.electronic_delay_ns = 300;
  const auto times =
      detections(SignalStream(one_segment(1e6, {0}, {1}), options, {}, TargetPath(linear(10)), 8),
                 200'000'000'000);
  const double expected_ps = 2 * 10 / light_m_per_ps + 300'000;
  double sum = 0;
  double squares = 0;
  for (const std::int64_t time : times) {
    const double late_ps = static_cast<double>(time % 1'000'000) - expected_ps;
    sum += late_ps;
    squares += late_ps * late_ps;
  }
  const double count = static_cast<double>(times.size());
  const double mean = sum / count;
  // An exponential of mean m for half of all: variance 2 m^2 / 2 - m^2 / 4.
  const double variance = 200.0 * 200 + 100 * 100 + 0.75 * 1e6;
  EXPECT_NEAR(mean, 500, 4 * std::sqrt(variance / count));
  EXPECT_NEAR(squares / count - mean * mean, variance, 0.03 * variance);
}

// Two photons of one pulse share its emission jitter; those of others do not.
TEST(SignalStream, EmissionJitterBelongsToThePulse) {
  DetectionOptions options = exact(2);
  options.emission_jitter_ps = 1000;
  const auto times =
      detections(SignalStream(one_segment(1e6, {0}, {1}), options, {}, TargetPath(linear(30)), 9),
                 10'000'000'000);
  int same = 0;
  int pairs = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] / 1'000'000 != times[i - 1] / 1'000'000) continue;
    ++pairs;
    same += times[i] == times[i - 1] ? 1 : 0;
  }
  EXPECT_GT(pairs, 5000);
  EXPECT_EQ(same, pairs);
  int repeats = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    repeats += times[i] - times[i - 1] == 1'000'000 ? 1 : 0;
  }
  EXPECT_LT(repeats, 20);
}

TEST(SignalStream, NoSignalGivesNoPhotons) {
  EXPECT_TRUE(detections(SignalStream(paper_pattern(), exact(0), {}, TargetPath(linear(10)), 1),
                         1'000'000'000)
                  .empty());
}

// A target that goes through the lidar gives light until then, and the stream goes on.
TEST(SignalStream, NoLightFromBehindTheLidar) {
  const auto times =
      detections(SignalStream(paper_pattern(), exact(0.1), {}, TargetPath(linear(3, -100)), 1),
                 100'000'000'000);
  ASSERT_FALSE(times.empty());
  EXPECT_NEAR(static_cast<double>(times.back()), 30e9, 1e8);
}

// The next photon may be years away: neither the start nor a slice of 1 ms waits for it.
TEST(SignalStream, AVeryDimTargetSendsNothingAndTakesNoLonger) {
  for (const double signal_per_pulse : {1e-12, 1e-15, 1e-300}) {
    SignalStream stream(paper_pattern(), exact(signal_per_pulse), {}, TargetPath(linear(150)), 1);
    for (std::int64_t to_ps = 0; to_ps <= 10'000'000'000; to_ps += 1'000'000'000) {
      stream.fill(to_ps);
      EXPECT_EQ(stream.pending().front(), PendingTimes::none);
    }
  }
}

// A photon is the same in whatever steps the stream comes to it, also where the signal's cable is
// much shorter than the sync's.
TEST(SignalStream, ADimTargetsPhotonsDoNotDependOnTheSteps) {
  for (const double delay_ns : {0.0, 1e6, -1e6}) {
    DetectionOptions dim;
    dim.signal_per_pulse = 1e-6;  // 10 photons a second
    dim.emission_jitter_ps = 50;
    dim.electronic_delay_ns = delay_ns;
    const auto all_ps = [&](std::int64_t step_ps) {
      SignalStream stream(paper_pattern(), dim, {}, TargetPath(linear(150)), 7);
      std::vector<std::int64_t> times_ps;
      for (std::int64_t to_ps = step_ps; to_ps <= 10'000'000'000'000; to_ps += step_ps) {
        stream.fill(to_ps);
        for (; stream.pending().front() < to_ps; stream.pending().pop()) {
          times_ps.push_back(stream.pending().front());
        }
      }
      return times_ps;
    };
    const std::vector<std::int64_t> at_once = all_ps(10'000'000'000'000);
    EXPECT_NEAR(static_cast<double>(at_once.size()), 106, 40);
    EXPECT_EQ(all_ps(1'000'000'000), at_once);
  }
}

}  // namespace
}  // namespace splid::simulator
