#include "estimator/paper/matched_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "protocol/pattern_make.hpp"
#include "tests/estimator/paper/paper_scene.hpp"

namespace splid::paper {
namespace {

// [P] Eq. 8 as it is written: photons by pulses.
double score_of(const test::PaperScene& scene, double delay_ns) {
  const PatternSegment& segment = scene.made.pattern.segments.front();
  const double period_ns = segment.period_ps * 1e-3;
  double score = 0;
  for (const double phase_ns : scene.folded.phase_ns) {
    double density = 0;
    for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
      const double off =
          std::remainder(phase_ns - delay_ns - segment.pulse_times_ps[p] * 1e-3, period_ns);
      density += segment.amplitudes[p] * std::exp(scene.shape->log_h(off));
    }
    score += std::log(1e-3 + density);
  }
  return score;
}

TEST(MatchedFilter, FindsTheBestDelayOfEquation8) {
  for (const double sigma_ns : {0.1, 6.0}) {  // 6 ns: pulses overlap
    test::FrameMaker made = test::simulated_scene(
        make_random({.period_ps = 378000, .pulses = 8, .min_spacing_ps = 9000}), 0);
    made.distance_m = 41;
    made.length_ms = 0.1;
    made.sigma_ns = sigma_ns;
    if (sigma_ns > 1) made.signal_per_pulse = 0.3;
    made.pattern.segments[0].amplitudes[3] = 2.5;
    const test::PaperScene scene(made, 3);
    const double found_ns = matched_delay_ns(scene.folded, scene.train, *scene.shape);
    EXPECT_NEAR(found_ns, scene.delay_start_ns(), sigma_ns);
    double most = 0;
    for (double delay_ns = 0; delay_ns < 378; delay_ns += sigma_ns / 2) {
      most = std::max(most, score_of(scene, delay_ns) - score_of(scene, found_ns));
    }
    // Candidates lie a quarter of a pulse width off at worst.
    EXPECT_LT(most, 0.02 * std::abs(score_of(scene, found_ns) - score_of(scene, found_ns + 50)));
  }
}

TEST(MatchedFilter, CountsSignalAndBackground) {
  test::FrameMaker made = test::simulated_scene(make_random({}), 60);
  made.length_ms = 10;
  const test::PaperScene scene(made, 3);
  const PaperParameters counting =
      count_signal(scene.folded, scene.train, 0.1, scene.delay_start_ns(), 100);
  // Windows of 14 ns about 40 pulses hold 16 % of the time or less.
  EXPECT_NEAR(counting.signal_per_pulse, 0.018, 0.018 * 5 / std::sqrt(1900.0));
  EXPECT_NEAR(counting.background_per_ns, 1e-3, 5 * std::sqrt(1e-3 / 8e6));
}

TEST(MatchedFilter, CountsHalvesWhereNothingIsOutside) {
  const test::PaperScene scene(test::simulated_scene(make_random({}), 0), 3);
  const PaperParameters counting = count_signal(scene.folded, scene.train, 0.1, 0, 1e6);
  const auto half = static_cast<double>(scene.frame.photons_ps.size()) / 2;
  EXPECT_NEAR(counting.background_per_ns, half / scene.folded.seen_ns, 1e-12);
  EXPECT_NEAR(counting.signal_per_pulse * 40 / 3780 * scene.folded.seen_ns, half, 1e-6);
}

}  // namespace
}  // namespace splid::paper
