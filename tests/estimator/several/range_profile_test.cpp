#include "estimator/several/range_profile.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

namespace splid {
namespace {

constexpr double profile_width_ns = 0.1;
constexpr double profile_dark = 2;  // photons in a bin

// What a gaussian pulse has between two places, from the error function: no code of the estimator.
RangeProfile::Counts light_of(const std::vector<RangeProfile::Target>& targets) {
  RangeProfile::Counts counts;
  counts.fill(profile_dark);
  const double per_width = profile_width_ns * std::sqrt(2.0);
  for (const RangeProfile::Target& target : targets) {
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const double first_ns =
          (RangeProfile::first_widths + static_cast<double>(i) * RangeProfile::bin_widths) *
              profile_width_ns -
          target.offset_ns;
      const double last_ns = first_ns + RangeProfile::bin_widths * profile_width_ns;
      counts[i] +=
          target.photons * (std::erf(last_ns / per_width) - std::erf(first_ns / per_width)) / 2;
    }
  }
  return counts;
}

RangeProfile::Row row_of(const std::vector<RangeProfile::Target>& targets) {
  RangeProfile::Row row;
  for (const RangeProfile::Target& target : targets) row.add(target);
  return row;
}

TEST(RangeProfile, PairsSettleWhereTheirLightIs) {
  const auto shape = make_gaussian(profile_width_ns);
  RangeProfile profile(*shape);
  for (const double apart_ns : {0.3, 0.4, 0.9}) {
    const std::vector<RangeProfile::Target> truth = {{-0.05, 600}, {apart_ns - 0.05, 450}};
    profile.see(light_of(truth), profile_dark);
    RangeProfile::Row found = row_of({{-0.1, 300}, {apart_ns + 0.05, 300}});
    profile.settle(found);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(found.all()[k].offset_ns, truth[k].offset_ns, 0.1 * profile_width_ns) << apart_ns;
      EXPECT_NEAR(found.all()[k].photons, truth[k].photons, 0.05 * truth[k].photons) << apart_ns;
    }
    profile.add_unexplained(found, 4, 0.3);
    EXPECT_EQ(found.count(), 2U) << apart_ns;
  }
}

TEST(RangeProfile, ShowsLightThatThePairDoesNotExplain) {
  const auto shape = make_gaussian(profile_width_ns);
  RangeProfile profile(*shape);
  for (const double third_ns : {-0.5, 0.8, 1.1}) {
    profile.see(light_of({{0, 600}, {0.4, 600}, {third_ns, 500}}), profile_dark);
    const RangeProfile::Row pair = row_of({{0, 600}, {0.4, 600}});
    RangeProfile::Row found = pair;
    profile.settle(found);
    profile.add_unexplained(found, 2, 0.3);
    ASSERT_EQ(found.count(), 2U) << third_ns;
    profile.add_unexplained(found, 4, 0.3);
    ASSERT_EQ(found.count(), 3U) << third_ns;
    EXPECT_NEAR(found.all()[2].offset_ns, third_ns, 0.2 * profile_width_ns);
    EXPECT_NEAR(found.all()[2].photons, 500, 50);
    EXPECT_GT(profile.nats(found), profile.nats(pair) + 100);
  }
}

// A tenth of the light is what a pulse of another shape leaves over, and six photons are chance.
TEST(RangeProfile, TakesNoTargetFromTheLightOfAFew) {
  const auto shape = make_gaussian(profile_width_ns);
  RangeProfile profile(*shape);
  RangeProfile::Row bright = row_of({{0, 6000}, {0.4, 6000}});
  profile.see(light_of({{0, 6000}, {0.4, 6000}, {1.0, 600}}), profile_dark);
  profile.add_unexplained(bright, 3, 0.3);
  EXPECT_EQ(bright.count(), 2U);
  profile.add_unexplained(bright, 3, 0.02);
  EXPECT_EQ(bright.count(), 3U);
  RangeProfile::Row weak = row_of({{0, 15}, {0.4, 15}});
  profile.see(light_of({{0, 15}, {0.4, 15}, {1.0, 6}}), profile_dark);
  profile.add_unexplained(weak, 3, 0.3);
  EXPECT_EQ(weak.count(), 2U);
}

// The difference of two rows is that of the sums over the bins of n log m - m, here by brute force.
TEST(RangeProfile, NatsAreThoseOfPoissonCounts) {
  const auto shape = make_gaussian(profile_width_ns);
  RangeProfile profile(*shape);
  const std::vector<RangeProfile::Target> one = {{0, 600}, {0.4, 300}}, other = {{0.1, 700}};
  const RangeProfile::Counts counts = light_of({{0, 500}, {0.4, 400}});
  profile.see(counts, profile_dark);
  const auto brute = [&](const std::vector<RangeProfile::Target>& targets) {
    // Where the profile takes the light at a bin's middle, so does this.
    long double sum = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const double middle_widths =
          RangeProfile::first_widths + (static_cast<double>(i) + 0.5) * RangeProfile::bin_widths;
      long double mean = profile_dark;
      for (const RangeProfile::Target& target : targets) {
        const long double x = middle_widths - target.offset_ns / profile_width_ns;
        mean += target.photons * RangeProfile::bin_widths * std::exp(-x * x / 2) /
                std::sqrt(2 * std::numbers::pi_v<long double>);
      }
      sum += counts[i] * std::log(mean) - mean;
    }
    return static_cast<double>(sum);
  };
  EXPECT_NEAR(profile.nats(row_of(one)) - profile.nats(row_of(other)), brute(one) - brute(other),
              1e-6);
}

// Where the pulse's peak is beside its time, and the pulse is not even, offsets are those of the
// pulse's time all the same.
TEST(RangeProfile, KnowsThePulsesShape) {
  TabulatedPulse table;
  table.first_ps = 100;
  table.step_ps = 20;
  for (int n = 0; n < 40; ++n) {
    table.density.push_back(n < 5 ? n / 5.0 : std::exp(-(n - 5) / 6.0));
  }
  const auto shape = make_tabulated(table);
  RangeProfile profile(*shape);
  const double bin_ns = RangeProfile::bin_widths * shape->width_ns();
  const double first_ns =
      shape->peak_offset_ns() + RangeProfile::first_widths * shape->width_ns() - 0.1;
  std::vector<double> ends_ns, integrals(RangeProfile::bins + 1);
  for (std::size_t i = 0; i <= RangeProfile::bins; ++i) {
    ends_ns.push_back(first_ns + static_cast<double>(i) * bin_ns);
  }
  shape->integrate(ends_ns, integrals);
  RangeProfile::Counts counts;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = profile_dark + 500 * (integrals[i + 1] - integrals[i]);
  }
  profile.see(counts, profile_dark);
  RangeProfile::Row found = row_of({{0.05, 250}});
  profile.settle(found);
  EXPECT_NEAR(found.all()[0].offset_ns, 0.1, 0.01);
}

}  // namespace
}  // namespace splid
