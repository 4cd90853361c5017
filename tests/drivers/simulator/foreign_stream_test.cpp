#include "drivers/simulator/foreign_stream.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdint>
#include <vector>

namespace splid::simulator {
namespace {

std::vector<std::int64_t> detections(const ForeignOptions& options, std::uint64_t seed = 1) {
  constexpr std::int64_t slice_ps = 1'000'000'000;
  ForeignStream stream(options, seed);
  std::vector<std::int64_t> times;
  for (std::int64_t to_ps = slice_ps; to_ps <= 100 * slice_ps; to_ps += slice_ps) {
    stream.fill(to_ps);
    for (; stream.pending().front() < to_ps; stream.pending().pop()) {
      times.push_back(stream.pending().front());
    }
  }
  return times;
}

// The mean of exp(2 pi i f t): its size is exp(-(2 pi f sigma)^2 / 2) where all pulses are in step.
std::complex<double> in_step(const std::vector<std::int64_t>& times, double frequency_hz) {
  std::complex<double> sum = 0;
  for (const std::int64_t time : times) {
    sum +=
        std::polar(1.0, 2 * M_PI * std::fmod(static_cast<double>(time) * 1e-12 * frequency_hz, 1));
  }
  return sum / static_cast<double>(times.size());
}

TEST(ForeignStream, PhotonsComeInPulsesAtTheStatedRate) {
  const ForeignOptions laser = {160'000, 80e6, 1000};
  const auto times = detections(laser);
  EXPECT_NEAR(static_cast<double>(times.size()), 16'000, 4 * std::sqrt(16'000));
  const double step = std::exp(-std::pow(2 * M_PI * 80e6 * 1e-9, 2) / 2);
  EXPECT_NEAR(std::abs(in_step(times, 80e6)), step, 4 / std::sqrt(32'000));
  EXPECT_LT(std::abs(in_step(times, 80.001e6)), 4 / std::sqrt(16'000));
}

// As many in each tenth of the time, and one to the next by chance: what a Poisson process gives.
TEST(ForeignStream, PickUpOfManyCountsAPulseIsPoisson) {
  const ForeignOptions pick_up = {3e6, 1e6, 0};
  const auto times = detections(pick_up);
  std::vector<double> counts(100'002);
  const std::int64_t phase = times.front() % 1'000'000;
  for (const std::int64_t time : times) {
    counts[static_cast<std::size_t>((time - phase + 500'000) / 1'000'000)] += 1;
    ASSERT_LE(std::abs((time - phase + 500'000) % 1'000'000 - 500'000), 1);
  }
  double squares = 0;
  for (std::size_t k = 1; k < 100'000; ++k) squares += (counts[k] - 3) * (counts[k] - 3);
  EXPECT_NEAR(static_cast<double>(times.size()), 3e5, 4 * std::sqrt(3e5));
  EXPECT_NEAR(squares / 99'999 / 3, 1, 4 * std::sqrt((2 + 1.0 / 3) / 1e5));
}

TEST(ForeignStream, NoneWithoutARate) { EXPECT_TRUE(detections({}).empty()); }

TEST(ForeignStream, SeedsDrawThePhaseAnew) {
  const ForeignOptions laser = {1e6, 1e6, 0};
  EXPECT_EQ(detections(laser), detections(laser));
  EXPECT_NE(detections(laser, 1).front() % 1'000'000, detections(laser, 2).front() % 1'000'000);
}

}  // namespace
}  // namespace splid::simulator
