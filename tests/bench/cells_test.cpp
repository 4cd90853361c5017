#include "bench/studies/cells.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bench/studies/expectation.hpp"

namespace splid::studies {
namespace {

TEST(Cells, EveryJobHasAKeyOfItsOwnAndAValidPattern) {
  std::set<std::string> keys;
  for (const Job& job : full_jobs(10)) {
    EXPECT_TRUE(keys.insert(key(job)).second) << key(job);
    EXPECT_EQ(validate(pattern_of(job.cell)), std::nullopt) << key(job);
  }
  for (const Job& job : quick_jobs(10)) EXPECT_TRUE(keys.contains(key(job))) << key(job);
  EXPECT_EQ(key(full_jobs(10).front()), "fig2,baseline,balanced,0.5,0.01,1e-05,30,search");
}

// [P] shows as many pulses of each period: 2450 of 100 ns and of 104 ns are its 4900 in 0.5 ms.
TEST(Cells, PeriodsInTurnHaveAsManyPulsesEach) {
  const auto repeats_of = [](Study study, double length_ms) {
    const Pattern pattern = pattern_of({.study = study, .mode = Mode::mrr, .length_ms = length_ms});
    EXPECT_EQ(pattern.segments.size(), 2U);
    EXPECT_EQ(pattern.segments.front().repeats, pattern.segments.back().repeats);
    return pattern.segments.front().repeats;
  };
  EXPECT_EQ(repeats_of(Study::fig2, 0.5), 2450);
  EXPECT_EQ(repeats_of(Study::fig3, 1.02), 5000);
  EXPECT_EQ(repeats_of(Study::fig9, 50), 135'501);
}

double least_spacing_ps(const PatternSegment& segment) {
  double least_ps = segment.period_ps - segment.pulse_times_ps.back();
  for (std::size_t p = 1; p < segment.pulse_times_ps.size(); ++p) {
    least_ps = std::min(least_ps, segment.pulse_times_ps[p] - segment.pulse_times_ps[p - 1]);
  }
  return least_ps;
}

// [P] section 4: 50 pulses in 2600 ns, one of them at random in each 52 ns. No two of them share a
// photon, which the expectation relies on.
TEST(Cells, RandomPulsesAreStratified) {
  const Pattern pattern = pattern_of({.study = Study::fig2, .mode = Mode::random});
  const PatternSegment& segment = pattern.segments.front();
  EXPECT_EQ(segment.period_ps, 2'600'000);
  ASSERT_EQ(segment.pulse_times_ps.size(), 50U);
  for (std::size_t p = 0; p < 50; ++p) {
    EXPECT_EQ(std::floor(segment.pulse_times_ps[p] / 52'000), static_cast<double>(p));
  }
  EXPECT_GT(least_spacing_ps(segment), 16e3 * pulse_sigma_ns);
  EXPECT_EQ(pulses_per_period(pattern_of({.study = Study::fig2, .mode = Mode::interleaved})), 50U);
}

// [P] Fig. 5 leaves out pulses less than 1 ns after the one before. Of 347 + 333 pulses, one is at
// 0 in both trains, and the others are multiples of 0.3 ns apart, each multiple up to 333 / 2 of
// them before and after: so 3 are 0.3, 0.6 and 0.9 ns behind another on either side.
TEST(Cells, PulsesOfFig5AreApartAndReadInTwoWays) {
  const Pattern whole = pattern_of({.study = Study::fig5_whole, .mode = Mode::interleaved});
  const Pattern modulo = pattern_of({.study = Study::fig5, .mode = Mode::interleaved});
  EXPECT_EQ(pattern_period_ps(whole), 34'665'300);
  EXPECT_GE(least_spacing_ps(whole.segments.front()), 1'000);
  EXPECT_EQ(pulses_per_period(whole), 347U + 333U - 1U - 6U);
  EXPECT_EQ(whole.unambiguous_delay_ps, 34'665'300);
  EXPECT_EQ(modulo.unambiguous_delay_ps, 2'600'000);
  EXPECT_EQ(whole.segments, modulo.segments);
}

// [P] Fig. 2 and 3 name them: 192, 4900, 9614 and 9614 pulses in 0.5 ms, then 10,000.
TEST(Cells, PulsesAreAsManyAsInThePaper) {
  const std::map<Mode, double> in_half_a_ms = {
      {Mode::baseline, 192}, {Mode::mrr, 4900}, {Mode::random, 9614}, {Mode::interleaved, 9614}};
  for (const Job& job : full_jobs(1)) {
    const Expectation e = expect(job.cell);
    const double pulses = e.signal_photons / job.cell.signal_per_pulse;
    if (job.cell.study == Study::fig2) {
      EXPECT_NEAR(pulses, in_half_a_ms.at(job.cell.mode), 15) << key(job);
    } else if (job.cell.study == Study::fig3) {
      EXPECT_NEAR(pulses, 10'000, 5) << key(job);
      EXPECT_NEAR(e.signal_photons, 100, 0.1) << key(job);
    } else if (job.cell.study == Study::fig4) {
      EXPECT_NEAR(e.signal_photons, 19.2, 0.1) << key(job);
      EXPECT_NEAR(e.background_photons, 100, 0.1) << key(job);
    }
  }
}

TEST(Cells, NamesReadBack) {
  for (const StudyInfo& study : all_studies()) {
    EXPECT_EQ(study_from_name(study.name), study.study);
    EXPECT_EQ(info(study.study).name, study.name);
  }
  for (const Estimator one : all_estimators()) {
    EXPECT_EQ(estimator_from_name(to_string(one)), one);
  }
  EXPECT_EQ(study_from_name("fig1"), std::nullopt);
}

}  // namespace
}  // namespace splid::studies
