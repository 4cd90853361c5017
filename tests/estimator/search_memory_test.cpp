#include "estimator/search_memory.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double bytes_a_mib = 1 << 20;

// What an estimator allocates and keeps that is made without room for photons.
double allocated_mib(const Pattern& pattern, const SceneOptions& scene, double length_ms) {
  const std::uint64_t before = test::allocated_bytes;
  EXPECT_FALSE(too_large_a_search(pattern, {}, scene, {}, length_ms));
  const std::uint64_t looked = test::allocated_bytes;
  const FrameEstimator estimator(pattern, {}, scene, {}, length_ms, 0);  // looks first, too
  return static_cast<double>(test::allocated_bytes - looked - (looked - before)) / bytes_a_mib;
}

double said_mib(const Pattern& pattern, const SceneOptions& scene, double length_ms) {
  return static_cast<double>(search_table_bytes(pattern, {}, scene, {}, length_ms)) / bytes_a_mib;
}

struct OfPattern {
  const char* name;
  Pattern pattern;
  double most_mib;  // in a frame of 15 s
};

std::array<OfPattern, 4> of_patterns() {
  return {{{"interleaved", test::interleaved_pattern({180000, 189000}, 3780000), 12},
           {"rates in turn", test::mrr_pattern({180000, 189000}, 3780000, 2e9), 28},
           {"random", test::random_pattern(3780000, 41, 9000, 3), 80},
           {"one pulse", test::periodic_pattern(180000), 80}}};
}

TEST(SearchMemory, IsWhatAnEstimatorAllocates) {
  for (const OfPattern& of : of_patterns()) {
    for (const double length_ms : {1.0, 50.0, 200.0, 1000.0, 5000.0, 15000.0}) {
      // Some 1.7 MiB have nothing to do with the search's tables, whatever the frame's length.
      const double allocated = allocated_mib(of.pattern, {}, length_ms);
      const double said = said_mib(of.pattern, {}, length_ms);
      EXPECT_NEAR(allocated, said + 1.7, 0.2 * said + 0.3) << of.name << ' ' << length_ms;
      std::printf("%-13s %7.0f ms  %6.2f MiB allocated, %6.2f said\n", of.name, length_ms,
                  allocated, said);
    }
  }
}

// A line of a long frame goes around the circle of delays many times: the tables grow with the
// slices of a frame, and not with their square.
TEST(SearchMemory, OfLongFramesIsSmall) {
  for (const OfPattern& of : of_patterns()) {
    EXPECT_LT(said_mib(of.pattern, {}, 15000), of.most_mib) << of.name;
    SceneOptions fast;
    fast.max_speed_mps = 1500;
    EXPECT_LT(said_mib(of.pattern, fast, 15000), 20 * of.most_mib) << of.name;
  }
}

TEST(SearchMemory, OfATargetAtRestDoesNotGrow) {
  SceneOptions at_rest;
  at_rest.motion = Motion::static_target;
  for (const OfPattern& of : of_patterns()) {
    EXPECT_EQ(said_mib(of.pattern, at_rest, 15000), said_mib(of.pattern, at_rest, 50)) << of.name;
  }
}

std::string said_of(double pulses, double apart_ps, double period_ps) {
  std::vector<double> times_ps;
  for (double k = 0; k < pulses; ++k) times_ps.push_back(k * apart_ps);
  Pattern pattern = test::periodic_pattern(period_ps);
  pattern.segments.front().amplitudes.assign(times_ps.size(), 1);
  pattern.segments.front().pulse_times_ps = std::move(times_ps);
  return test::error_text([&] { const FrameEstimator made(pattern, {}, {}, {}, 50, 0); });
}

// A pattern whose tables would take 11.6 GiB and a minute to make is refused before they are made.
TEST(SearchMemory, OfTooManyIsRefusedBeforeItIsTaken) {
  const std::uint64_t before = test::allocated_bytes;
  EXPECT_EQ(said_of(100, 50, 1e9),
            "/pattern: the tables of the search would take 11721 MiB, 1024 at most: its pulses are "
            "0.05 ns apart or more, in 1e+06 ns; space the pulses, shorten the period, or lower "
            "/scene/max_speed_mps, /frame/length_ms or /estimator/effort");
  EXPECT_EQ(said_of(20000, 1, 3780000),
            "/pattern: a photon may be near 4116 pulses, 256 at most: the closest pulses are 0.001 "
            "ns apart, and a pulse is 0.1 ns wide; space the pulses, or take a narrower /pulse");
  EXPECT_LT(test::allocated_bytes - before, 16 * bytes_a_mib);
  EXPECT_EQ(said_of(100, 50, 5e7), "");
}

}  // namespace
}  // namespace splid
