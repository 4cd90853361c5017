#include "estimator/calibration/input_shift.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace splid::calibration {
namespace {

Calibration pulses_at(std::vector<double> times_ps, double shift_ps) {
  Calibration found;
  found.period_ps = 12'512.6;
  found.width_ps = 80;
  for (double& time_ps : times_ps) {
    time_ps += shift_ps;
    time_ps -= found.period_ps * std::floor(time_ps / found.period_ps);
  }
  std::sort(times_ps.begin(), times_ps.end());
  for (const double time_ps : times_ps) found.pulses.push_back({time_ps, 0.7, 1, 0.01});
  return found;
}

// As in a recording of a real tagger: 3,128 ps apart to 60 ps.
const std::vector<double> nearly_even_ns{1'412.6, 4'525.6, 7'688.5, 10'760.9};

TEST(InputShift, IsFoundWhateverItIs) {
  for (const double shift_ps : {-6'000.0, -2'053.0, -30.0, 0.0, 1'060.0, 3'128.0, 6'200.0}) {
    const auto found =
        shift_between(pulses_at(nearly_even_ns, 0), pulses_at(nearly_even_ns, shift_ps));
    ASSERT_TRUE(found) << shift_ps;
    EXPECT_NEAR(found->shift_ps, shift_ps, 1e-6);
    EXPECT_NEAR(found->std_ps, 0.7 * std::sqrt(2.0) / 2, 1e-9);
    EXPECT_LT(found->rms_ps, 1e-6);
  }
}

TEST(InputShift, OfAnEvenCombIsTheSmallest) {
  const std::vector<double> even{0, 3'128.15, 6'256.3, 9'384.45};
  const auto found = shift_between(pulses_at(even, 500), pulses_at(even, 500 + 3'128.15 + 7));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->shift_ps, 7, 1e-6);
}

TEST(InputShift, IsNoneOfOtherPulses) {
  EXPECT_FALSE(shift_between(pulses_at(nearly_even_ns, 0), pulses_at({0, 2'000, 5'000, 9'500}, 0)));
  EXPECT_FALSE(shift_between(pulses_at(nearly_even_ns, 0), pulses_at({0, 3'000}, 0)));
  EXPECT_FALSE(shift_between(pulses_at({}, 0), pulses_at({}, 0)));
}

}  // namespace
}  // namespace splid::calibration
