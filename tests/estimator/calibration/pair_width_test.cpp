#include "estimator/calibration/pair_width.hpp"

#include <gtest/gtest.h>

#include "tests/support/frame_maker.hpp"

namespace splid::calibration {
namespace {

// Twelve pulses of this width, in a fold whose bins are those of another configured width.
std::optional<double> width_of(double sigma_ps, double configured_ps, double signal_per_pulse) {
  test::FrameMaker made;
  made.pattern = test::random_pattern(1'000'000, 12, 9000, 4);
  made.sigma_ns = sigma_ps * 1e-3;
  made.signal_per_pulse = signal_per_pulse;
  made.background_per_ns = 2e-4;
  PhaseHistogram fold(1'000'000, configured_ps);
  for (std::uint64_t n = 0; n < 10; ++n) {
    fold.add(made.make(n).view());
    made.start_ps += 50'000'000'000;
  }
  return width_by_pairs_ps(fold);
}

TEST(PairWidth, IsThatOfThePulsesWhateverWasConfigured) {
  for (const double sigma_ps : {20.0, 100.0, 700.0}) {
    for (const double configured_ps : {2.0, 100.0, 500.0}) {
      const auto found_ps = width_of(sigma_ps, configured_ps, 0.01);
      ASSERT_TRUE(found_ps) << sigma_ps << " " << configured_ps;
      EXPECT_GT(*found_ps, 0.65 * sigma_ps) << configured_ps;
      EXPECT_LT(*found_ps, 1.5 * sigma_ps) << configured_ps;
    }
  }
}

TEST(PairWidth, AbsentWherePhotonsShowNoPulses) {
  EXPECT_FALSE(width_of(100, 100, 0));
  EXPECT_FALSE(width_by_pairs_ps(PhaseHistogram(1'000'000, 100)));
}

}  // namespace
}  // namespace splid::calibration
