#include "estimator/search/target_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "estimator/search/significance.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

using likelihood::Maximum;

constexpr double sigma_ns = 0.1;
constexpr double light_speed = 299792458.0;

// The likelihood by the book, for a scene small enough for it: every photon against every pulse, in
// the tagger's own times, at every delay and range walk of a grid finer than the pulse. No product
// code.
class BruteForceSearch {
 public:
  BruteForceSearch(const test::FrameMaker& made, const test::FrameMaker::Frame& frame)
      : pulses_(made.pattern.segments.front().pulse_times_ps),
        period_ns_(made.pattern.segments.front().period_ps * 1e-3) {
    const std::int64_t mid_ps = frame.start_ps + (frame.end_ps - frame.start_ps) / 2;
    for (const std::int64_t photon_ps : frame.photons_ps) {
      time_ns_.push_back(static_cast<double>(photon_ps - mid_ps) * 1e-3);
      phase_ns_.push_back(static_cast<double>(photon_ps - frame.start_ps) * 1e-3);
    }
    length_ns_ = static_cast<double>(frame.end_ps - frame.start_ps) * 1e-3;
  }

  // The gain over no target of the best signal at a line: the maximum over f of the sum of
  // log(1 + f (r - 1)), where r is the density of the pulses' light at a photon over the flat one.
  [[nodiscard]] double gain(DelayTrack line) const {
    const double g = line.walk_ns / length_ns_;
    const double flat = static_cast<double>(pulses_.size()) / period_ns_;
    std::vector<double> ratios;
    for (std::size_t i = 0; i < time_ns_.size(); ++i) {
      double density = 0;
      for (const double pulse_ps : pulses_) {
        const double off_ns =
            std::remainder(phase_ns_[i] - line.delay_ns - g * time_ns_[i] - pulse_ps * 1e-3,
                           period_ns_) /
            (1 - g);
        const double x = off_ns / sigma_ns;
        if (std::abs(x) < 9) {
          density += std::exp(-0.5 * x * x) / (sigma_ns * std::sqrt(2 * M_PI));
        }
      }
      ratios.push_back(density / (flat * (1 - g)));
    }
    return best_gain(ratios);
  }

  // The best line with a delay anywhere and a range walk within the limit.
  [[nodiscard]] DelayTrack best(double max_walk_ns) const {
    DelayTrack line;
    double most = -1;
    for (double walk = -max_walk_ns; walk <= max_walk_ns; walk += 0.8 * sigma_ns) {
      for (double delay = 0; delay < period_ns_; delay += 0.4 * sigma_ns) {
        // Few places are worth the sum: a gain of any size takes photons within three widths.
        if (near(delay, walk) < nearest_wanted_) continue;
        const double found = gain({delay, walk});
        if (found > most) {
          most = found;
          line = {delay, walk};
        }
      }
    }
    return line;
  }

  void want_near(int photons) { nearest_wanted_ = photons; }

 private:
  [[nodiscard]] int near(double delay_ns, double walk_ns) const {
    int count = 0;
    for (std::size_t i = 0; i < time_ns_.size(); ++i) {
      const double at = phase_ns_[i] - delay_ns - walk_ns * time_ns_[i] / length_ns_;
      for (const double pulse_ps : pulses_) {
        if (std::abs(std::remainder(at - pulse_ps * 1e-3, period_ns_)) < 3 * sigma_ns) ++count;
      }
    }
    return count;
  }

  // Bisection of the derivative by f, which falls: the sum is concave.
  [[nodiscard]] static double best_gain(const std::vector<double>& ratios) {
    double low = 0, high = 1 - 1e-12;
    for (int round = 0; round < 60; ++round) {
      const double f = (low + high) / 2;
      double slope = 0;
      for (const double r : ratios) slope += (r - 1) / (1 + f * (r - 1));
      (slope > 0 ? low : high) = f;
    }
    double sum = 0;
    for (const double r : ratios) sum += std::log1p(low * (r - 1));
    return sum;
  }

  std::vector<double> pulses_;
  double period_ns_;
  double length_ns_ = 0;
  std::vector<double> time_ns_, phase_ns_;
  int nearest_wanted_ = 0;
};

// Five pulses in 126 ns, for 0.1 ms: some 25 photons of signal among 100.
test::FrameMaker small_scene(const Pattern& pattern, double velocity_mps) {
  test::FrameMaker made;
  made.pattern = pattern;
  made.length_ms = 0.1;
  made.distance_m = 7.3;
  made.velocity_mps = velocity_mps;
  made.signal_per_pulse = 6e-3;
  made.background_per_ns = 1e-3;
  return made;
}

struct Searched {
  test::FrameMaker::Frame photons;
  PulseTrain train;
  FoldedFrame frame;
  std::unique_ptr<PulseShape> shape = make_gaussian(sigma_ns);
  SearchVolume volume;
  TargetSearch search;

  Searched(const test::FrameMaker& made, std::uint64_t seed, double max_walk_ns)
      : photons(made.make(seed)),
        train(made.pattern),
        frame(train, photons.photons_ps.size()),
        volume{train.circle_ns, max_walk_ns, sigma_ns},
        search(train, *shape,
               {made.length_ms * 1e6, max_walk_ns, significance_threshold_nats(volume, 1e-3),
                volume, 7},
               photons.photons_ps.size()) {
    frame.fold(photons.view(), train);
  }

  [[nodiscard]] double apart_ns(DelayTrack a, DelayTrack b) const {
    return std::abs(std::remainder(a.delay_ns - b.delay_ns, train.circle_ns));
  }
};

double walk_of(double velocity_mps, double length_ns) {
  const double beta = velocity_mps / light_speed;
  return 2 * beta / (1 + beta) * length_ns;
}

TEST(TargetSearch, FindsTheMaximumThatBruteForceFinds) {
  const Pattern patterns[] = {test::interleaved_pattern({42000, 63000}, 126000),
                              test::random_pattern(126000, 5, 9000, 2),
                              test::random_pattern(126000, 3, 9000, 5)};
  for (const Pattern& pattern : patterns) {
    for (const double velocity_mps : {0.0, 1100.0, -1450.0}) {
      const test::FrameMaker made = small_scene(pattern, velocity_mps);
      Searched s(made, 5, walk_of(1500, 1e5));
      BruteForceSearch brute(made, s.photons);
      brute.want_near(8);
      const DelayTrack expected = brute.best(walk_of(1500, 1e5));
      const std::optional<Maximum> fit = s.search.find(s.frame);
      ASSERT_TRUE(fit);
      EXPECT_LT(s.apart_ns(fit->track(), expected), sigma_ns) << velocity_mps;
      EXPECT_NEAR(fit->track().walk_ns, expected.walk_ns, 2 * sigma_ns);
      // The same likelihood, and between the points of the grid a little more of it.
      EXPECT_NEAR(fit->gain_nats, brute.gain(fit->track()), 1e-6);
      EXPECT_GT(fit->gain_nats, brute.gain(expected) - 1e-9);
      EXPECT_LT(s.apart_ns(fit->track(), {2 * 7.3 / 0.299792458, 0}), 3 * sigma_ns);
    }
  }
}

TEST(TargetSearch, ATargetAtRestIsFoundWithoutTravel) {
  const test::FrameMaker made = small_scene(test::random_pattern(126000, 5, 9000, 2), 0);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Searched s(made, seed, 0);
    BruteForceSearch brute(made, s.photons);
    brute.want_near(8);
    const DelayTrack expected = brute.best(0);
    const std::optional<Maximum> fit = s.search.find(s.frame);
    ASSERT_TRUE(fit);
    EXPECT_EQ(fit->track().walk_ns, 0);
    EXPECT_LT(s.apart_ns(fit->track(), expected), sigma_ns) << seed;
    EXPECT_GT(fit->gain_nats, brute.gain(expected) - 1e-9);
  }
}

// Pulses at 0, 42, 63 and 84 ns in 126: moved by 42 ns, two of the four fall on others.
TEST(TargetSearch, LookBesideLeavesASideLobeForThePeak) {
  const test::FrameMaker made = small_scene(test::interleaved_pattern({42000, 63000}, 126000), 300);
  Searched s(made, 3, walk_of(1500, 1e5));
  const std::optional<Maximum> peak = s.search.find(s.frame);
  ASSERT_TRUE(peak);
  const DelayTrack truth = peak->track();
  const Maximum side_lobe = s.search.find_near(s.frame, {truth.delay_ns + 42, truth.walk_ns});
  EXPECT_LT(s.apart_ns(side_lobe.track(), {truth.delay_ns + 42, 0}), 2 * sigma_ns);
  EXPECT_LT(side_lobe.gain_nats, 0.7 * peak->gain_nats);
  const Maximum beside = s.search.look_beside(s.frame, side_lobe);
  EXPECT_LT(s.apart_ns(beside.track(), truth), 1e-4);
  EXPECT_NEAR(beside.gain_nats, peak->gain_nats, 1e-6);
  // From the side_lobe's view the peak is another range, and the better one.
  EXPECT_LT(s.search.range_odds_nats(side_lobe), 0);
}

TEST(TargetSearch, JudgesAndFitsByTheSameLikelihood) {
  const test::FrameMaker made = small_scene(test::random_pattern(126000, 5, 9000, 2), 700);
  Searched s(made, 8, walk_of(1500, 1e5));
  const BruteForceSearch brute(made, s.photons);
  const std::optional<Maximum> fit = s.search.find(s.frame);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(s.search.judge(s.frame, fit->model).gain_nats, fit->gain_nats, 1e-6);
  likelihood::Model darker = fit->model;
  darker.targets[0].signal_per_pulse /= 2;
  EXPECT_LT(s.search.judge(s.frame, darker).gain_nats, fit->gain_nats - 1);
  const Maximum moving = s.search.fit(s.frame, fit->track(), 2);
  EXPECT_NEAR(moving.gain_nats, fit->gain_nats, 1e-6);
  const Maximum rest = s.search.fit(s.frame, {fit->track().delay_ns}, 1);
  EXPECT_EQ(rest.track().walk_ns, 0);
  EXPECT_NEAR(rest.gain_nats, brute.gain(rest.track()), 1e-6);
  EXPECT_LT(rest.gain_nats, fit->gain_nats);
}

// Three times 65,536 photons and more: a sample finds the target, all photons refine it.
TEST(TargetSearch, AVeryBrightFrameIsRefinedOnAllPhotons) {
  test::FrameMaker made = small_scene(test::random_pattern(1260000, 13, 9000, 2), 40);
  made.length_ms = 10;
  made.distance_m = 20;
  made.signal_per_pulse = 1;
  made.background_per_ns = 0.015;
  Searched s(made, 1, walk_of(150, 1e7));
  ASSERT_GT(s.frame.size(), 200'000U);
  const std::optional<Maximum> fit = s.search.find(s.frame);
  ASSERT_TRUE(fit);
  const double beta = 40 / light_speed;
  const DelayTrack truth = {2 * 20 / 0.299792458 / (1 + beta), walk_of(40, s.frame.length_ns)};
  // 100 ps from some 100,000 photons is 0.3 ps; of a sample it would be 0.6.
  ASSERT_TRUE(fit->has_covariance);
  EXPECT_NEAR(std::sqrt(fit->covariance(0, 0)), 0.32e-3, 0.05e-3);
  EXPECT_LT(s.apart_ns(fit->track(), truth), 2e-3);
  EXPECT_NEAR(fit->track().walk_ns, truth.walk_ns, 6e-3);
  EXPECT_NEAR(fit->signal_per_pulse(), 1, 0.02);
}

TEST(TargetSearch, NothingIsFoundInAFrameWithoutPhotons) {
  test::FrameMaker made = small_scene(test::random_pattern(126000, 5, 9000, 2), 0);
  made.signal_per_pulse = made.background_per_ns = 0;
  Searched s(made, 1, walk_of(1500, 1e5));
  ASSERT_EQ(s.frame.size(), 0U);
  EXPECT_FALSE(s.search.find(s.frame));
}

}  // namespace
}  // namespace splid
