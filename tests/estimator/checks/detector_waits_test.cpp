#include "estimator/checks/detector_waits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "protocol/pattern_make.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::checks {
namespace {

constexpr double pulse_ns = 0.1;

test::FrameMaker light(double signal_per_pulse, double dead_time_ns) {
  test::FrameMaker made;
  made.pattern = make_interleaved(std::vector<double>{180'000, 189'000});
  made.signal_per_pulse = signal_per_pulse;
  made.dead_time_ns = dead_time_ns;
  return made;
}

// A second of light.
FoundList found(const test::FrameMaker& made, double configured_ns, std::uint64_t seed = 1) {
  DetectorWaits waits(configured_ns);
  double photons = 0;
  for (std::uint64_t k = 0; k < 20; ++k) {
    const auto frame = made.make(seed * 100 + k);
    waits.add(frame.photons_ps, frame.sync.period_ps);
    photons = static_cast<double>(frame.photons_ps.size());
  }
  return waits.found(photons, pulse_ns);
}

std::optional<Finding> one(const FoundList& list, FindingName name) {
  for (const Finding& finding : list.all()) {
    if (finding.name == name) return finding;
  }
  return std::nullopt;
}

TEST(DetectorWaits, ADeadTimeThatIsNotGivenIsFound) {
  for (const double S : {0.00135, 0.05, 0.5}) {
    test::FrameMaker made = light(S, 50);
    made.length_ms = S > 0.1 ? 5 : 50;
    const FoundList list = found(made, 0);
    ASSERT_EQ(list.all().size(), 1U) << S;
    const auto dead = one(list, FindingName::dead_time);
    ASSERT_TRUE(dead) << S;
    EXPECT_NEAR(dead->value, 50, 1.5) << S;
    EXPECT_GT(dead->std, 0);
    EXPECT_GT(dead->gain_nats, 100);
    EXPECT_EQ(found(made, 50).all().size(), 0U) << S;
  }
}

TEST(DetectorWaits, ADeadTimeThatIsTooLongIsContradicted) {
  const auto dead = one(found(light(0.05, 50), 80), FindingName::dead_time);
  ASSERT_TRUE(dead);
  EXPECT_NEAR(dead->value, 50, 1.5);
}

// Longer than all waits that are told apart, as detectors for 1.5 um have it.
TEST(DetectorWaits, ADeadTimeOfManyMicrosecondsIsNotContradicted) {
  for (const double dead_ns : {18'000.0, 30'000.0, 50'000.0, 200'000.0}) {
    const test::FrameMaker made = light(0.05, dead_ns);
    EXPECT_TRUE(found(made, dead_ns).all().empty()) << dead_ns;
    if (dead_ns < 35'000) {
      EXPECT_TRUE(one(found(made, 0), FindingName::dead_time)) << dead_ns;
    }
  }
}

// Of weak light no more is lost than a frame's own scatter.
TEST(DetectorWaits, ADeadTimeThatHardlyMattersIsNotFound) {
  EXPECT_EQ(found(light(0.0002, 5), 0).all().size(), 0U);
}

TEST(DetectorWaits, AfterpulsesAreCounted) {
  for (const double share : {0.01, 0.05}) {
    test::FrameMaker made = light(0.02, 50);
    made.afterpulse_probability = share;
    made.afterpulse_ns = 100;
    const FoundList list = found(made, 50);
    ASSERT_EQ(list.all().size(), 1U) << share;
    const auto after = one(list, FindingName::afterpulsing);
    ASSERT_TRUE(after) << share;
    EXPECT_NEAR(after->value, share, 4 * after->std + 0.1 * share) << share;
    EXPECT_LT(after->std, 0.003);
  }
}

// An ideal detector and one with a given dead time, in weak light, bright pulses, and light that
// varies: nothing in six runs of each.
TEST(DetectorWaits, NothingIsFoundInARightDetector) {
  for (const double dead_ns : {0.0, 50.0}) {
    for (const double S : {0.00135, 0.2}) {
      test::FrameMaker made = light(S, dead_ns);
      made.length_ms = 5;
      made.signal_swing = made.background_swing = 0.8;
      for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        for (const Finding& finding : found(made, dead_ns, seed).all()) {
          ADD_FAILURE() << dead_ns << " " << S << " " << static_cast<int>(finding.name) << " "
                        << finding.value << " " << finding.gain_nats;
        }
      }
    }
  }
}

TEST(DetectorWaits, FewTagsSayNothing) {
  DetectorWaits waits(0);
  EXPECT_TRUE(waits.found(100, pulse_ns).all().empty());
  const std::int64_t times[] = {INT64_MIN / 2, 0, 5, 5, 1000, INT64_MAX / 2};
  waits.add({}, 3'780'000);
  waits.add(times, 3'780'000);
  waits.add_return(10, 0.1, 1);
  EXPECT_TRUE(waits.found(100, pulse_ns).all().empty());
  EXPECT_TRUE(waits.walk(pulse_ns).empty());
}

}  // namespace
}  // namespace splid::checks
