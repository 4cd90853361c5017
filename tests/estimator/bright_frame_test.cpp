#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

// Frames of so many photons that a search may look at a part of them first. What is said of the
// frame must hold of all its photons.

namespace splid {
namespace {

constexpr double bright_c_m_per_ns = 0.299792458;
constexpr std::size_t most_bright_photons = 400'000;

// 220,000 photons of which 290 are the target's: it stands some 25 nats above the threshold. A
// third of them would not show it.
TEST(BrightFrame, ATargetThatOnlyAllPhotonsShowIsFound) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.background_per_ns = 4.4e-3;
  made.velocity_mps = 60;
  made.signal_per_pulse = 5.5e-4;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, most_bright_photons);
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto frame = made.make(seed);
    ASSERT_GT(frame.photons_ps.size(), 210'000U);
    const Estimate e = estimator.estimate(frame.view());
    const double off_ns =
        std::remainder(e.delay_ns - 2 * made.distance_m / bright_c_m_per_ns, 3780);
    const bool is_right = std::abs(off_ns) < 5 * e.std_delay_ns;
    found += e.status == FrameStatus::ok && is_right ? 1 : 0;
  }
  EXPECT_GE(found, 7);
}

// Pulses even to within half their width: shifted by one of them, all but fits. The odds against
// that range come from all photons, or from fewer on either side: three times the photons have
// three times the odds at most, give or take a half.
TEST(BrightFrame, OddsAreNoSurerThanItsPhotons) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(12512.6);
  made.pattern.mode = Mode::random;
  made.pattern.segments = {{12512.6, {1415, 4530, 7692, 10764}, {1, 1, 1, 1}, 0}};
  made.length_ms = 5;
  made.distance_m = 0.9;
  made.signal_per_pulse = 0.03;
  made.background_per_ns = 0.045;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, most_bright_photons);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto frame = made.make(seed);
    ASSERT_GT(frame.photons_ps.size(), 250'000U);
    const Estimate all = estimator.estimate(frame.view());
    std::vector<std::int64_t> third;
    for (std::size_t i = 0; i < frame.photons_ps.size(); i += 3) {
      third.push_back(frame.photons_ps[i]);
    }
    frame.photons_ps = third;
    const Estimate few = estimator.estimate(frame.view());
    EXPECT_EQ(all.status, FrameStatus::ok);
    EXPECT_GT(few.range_odds_nats, 50) << seed;
    EXPECT_GT(all.range_odds_nats, few.range_odds_nats / 2) << seed;
    EXPECT_LT(all.range_odds_nats, few.range_odds_nats * 4.5) << seed;
  }
}

}  // namespace
}  // namespace splid
