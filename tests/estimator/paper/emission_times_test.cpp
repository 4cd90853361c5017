#include "estimator/paper/emission_times.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "protocol/pattern_make.hpp"

namespace splid::paper {
namespace {

using Offsets = std::vector<std::pair<double, double>>;

// Every pulse of five pattern periods, one after the other.
Offsets all_near(const Pattern& pattern, double phase_ns, double first_ns, double last_ns) {
  Offsets near;
  const double period_ns = pattern_period_ps(pattern) * 1e-3;
  for (int turn = -2; turn <= 2; ++turn) {
    double begin_ns = turn * period_ns;
    for (const PatternSegment& segment : pattern.segments) {
      const auto repeats = pattern.segments.size() == 1 ? 1 : segment.repeats;
      for (int n = 0; n < repeats; ++n) {
        for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
          const double at = begin_ns + (n * segment.period_ps + segment.pulse_times_ps[p]) * 1e-3;
          const double offset = phase_ns - at;
          if (segment.amplitudes[p] > 0 && offset >= first_ns && offset <= last_ns) {
            near.emplace_back(offset, segment.amplitudes[p]);
          }
        }
      }
      begin_ns += static_cast<double>(repeats) * segment.period_ps * 1e-3;
    }
  }
  return near;
}

std::vector<Pattern> patterns() {
  Pattern uneven = make_random({});
  for (std::size_t p = 0; p < 40; ++p) uneven.segments[0].amplitudes[p] = double(p % 4);
  Pattern mrr =
      make_mrr(std::vector<double>{90000, 99000, 101000}, std::vector<std::int64_t>{3, 1, 5});
  mrr.segments[1].pulse_times_ps = {500, 40000, 98000};
  mrr.segments[1].amplitudes = {1, 0.5, 2};
  return {make_periodic(Mode::baseline, 3780000), uneven, mrr};
}

TEST(EmissionTimes, FindsThePulsesThatAListHas) {
  std::mt19937_64 random(1);
  for (const Pattern& pattern : patterns()) {
    const EmissionTimes emission(pattern);
    std::uniform_real_distribution<double> phase(-0.2 * emission.period_ns(),
                                                 1.2 * emission.period_ns());
    for (const double reach_ns : {1.0, 60.0, 700.0}) {
      for (int trial = 0; trial < 200; ++trial) {
        const double at = phase(random);
        const Offsets expected = all_near(pattern, at, -reach_ns, reach_ns / 2);
        Offsets found;
        emission.near(at, -reach_ns, reach_ns / 2, [&](double offset, double amplitude) {
          found.emplace_back(offset, amplitude);
        });
        ASSERT_EQ(found.size(), expected.size());
        EXPECT_EQ(emission.any_near(at, -reach_ns, reach_ns / 2), !expected.empty());
        for (std::size_t i = 0; i < found.size(); ++i) {
          EXPECT_NEAR(found[i].first, expected[i].first, 1e-9);
          EXPECT_EQ(found[i].second, expected[i].second);
        }
      }
    }
  }
}

TEST(EmissionTimes, KnowsPeriodAndMeanAmplitude) {
  const EmissionTimes emission(patterns()[2]);
  EXPECT_DOUBLE_EQ(emission.period_ns(), 3 * 90 + 99 + 5 * 101);
  EXPECT_DOUBLE_EQ(emission.train().amplitude_per_ns * emission.period_ns(), 3 + 3.5 + 5);
  EXPECT_DOUBLE_EQ(emission.train().segments[2].begin_ns, 3 * 90 + 99);
}

}  // namespace
}  // namespace splid::paper
