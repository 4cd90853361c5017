#include "bench/studies/cells.hpp"

#include <gtest/gtest.h>

#include <set>

namespace splid::studies {
namespace {

TEST(Cells, EveryJobHasAKeyOfItsOwnAndAValidPattern) {
  std::set<std::string> keys;
  for (const Job& job : full_jobs(10)) {
    EXPECT_TRUE(keys.insert(key(job)).second) << key(job);
    EXPECT_EQ(validate(pattern_of(job.cell)), std::nullopt) << key(job);
  }
  for (const Job& job : quick_jobs(10)) EXPECT_TRUE(keys.contains(key(job))) << key(job);
  EXPECT_EQ(key(full_jobs(10).front()), "fig2,baseline,balanced,0.5,0.018,1e-05,any,search");
}

TEST(Cells, PeriodsInTurnHaveHalfAFrameEach) {
  const Pattern pattern = pattern_of({.study = Study::fig5, .mode = Mode::mrr, .length_ms = 2});
  ASSERT_EQ(pattern.segments.size(), 2U);
  for (const PatternSegment& segment : pattern.segments) {
    EXPECT_NEAR(static_cast<double>(segment.repeats) * segment.period_ps, 1e9, segment.period_ps);
  }
  EXPECT_EQ(pattern.unambiguous_delay_ps, 34'665'300);
}

TEST(Cells, NamesReadBack) {
  for (const StudyInfo& study : all_studies()) {
    EXPECT_EQ(study_from_name(study.name), study.study);
    EXPECT_EQ(info(study.study).name, study.name);
  }
  for (const Estimator one : {Estimator::search, Estimator::paper, Estimator::wang}) {
    EXPECT_EQ(estimator_from_name(to_string(one)), one);
  }
  EXPECT_EQ(study_from_name("fig1"), std::nullopt);
}

}  // namespace
}  // namespace splid::studies
