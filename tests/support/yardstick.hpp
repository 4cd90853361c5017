#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <stop_token>
#include <thread>
#include <vector>

namespace splid::test {

// Measures, beside a test, how much slower the machine is just now than a quiet one, so that a
// promised time can be asserted on any machine. Its thread wakes every 10 ms and does work that
// takes 1 ms of a quiet core at 2.6 GHz; where the work takes longer, it wakes less often. The
// slowness is the mean time from the moment at which the thread should have woken to the end of its
// work, beside 1.1 ms: 4 on a machine at a quarter of the speed, and 4 where four threads want each
// core. In a build with sanitizers the work takes as many times longer as the code that is tested.
//
// Threads: any.
class Yardstick {
 public:
  // 1 or more, since this was made.
  [[nodiscard]] double slowness() const {
    const auto rounds = static_cast<double>(rounds_);
    return rounds == 0 ? 1 : std::max(1.0, static_cast<double>(spent_ns_) / 1.1e6 / rounds);
  }

  // Whether what took so long keeps its promise. Design note: twice the promised time passes, times
  // the slowness, so that ten times the promised time fails on any machine that is less than five
  // times slower than a quiet one.
  [[nodiscard]] ::testing::AssertionResult keeps(double promised_ms, double took_ms) const {
    const double slow = slowness();
    if (took_ms <= 2 * promised_ms * slow) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << took_ms << " ms, where " << promised_ms
                                         << " ms are promised, and this machine is now " << slow
                                         << " times slower than a quiet one";
  }

 private:
  using Clock = std::chrono::steady_clock;

  // The thread sleeps ten times as long as it works. Under the thread sanitizer the work takes more
  // than 10 ms, and without the longer sleep it would take a whole core from what is tested.
  void run(const std::stop_token& stop) {
    Clock::duration rest{};
    while (!stop.stop_requested()) {
      const auto due =
          Clock::now() + std::max<Clock::duration>(std::chrono::milliseconds{10}, rest);
      std::this_thread::sleep_until(due);
      const auto begin = Clock::now();
      work();
      rest = 10 * (Clock::now() - begin);
      spent_ns_ += std::chrono::nanoseconds(Clock::now() - due).count();
      ++rounds_;
    }
  }

  // Reads and writes memory, which is what sanitizers make slow.
  void work() {
    for (int round = 0; round < work_rounds; ++round) {
      for (std::uint32_t& number : numbers_) {
        number ^= number << 13U;
        number ^= number >> 17U;
        number ^= number << 5U;
      }
    }
  }

  static constexpr int work_rounds = 5100;

  std::array<std::uint32_t, 256> numbers_ = [] {
    std::array<std::uint32_t, 256> first{};
    for (std::uint32_t i = 0; i < first.size(); ++i) first.at(i) = i + 1;
    return first;
  }();
  std::atomic<std::int64_t> spent_ns_{0};
  std::atomic<std::int64_t> rounds_{0};
  std::jthread thread_{[this](const std::stop_token& stop) { run(stop); }};
};

// Of several trials: what a single late wake-up does not move.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace splid::test
