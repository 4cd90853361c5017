#include "drivers/pace.hpp"

#include <algorithm>
#include <thread>

namespace splid {

Pace::Pace(double speed) : speed_(speed), start_(std::chrono::steady_clock::now()) {}

// Design note: short sleeps and a look at the token, not a condition variable: waking 200 times a
// second costs nothing that can be measured, and a stop needs no lock.
bool Pace::wait_until(std::int64_t stream_ps, const std::stop_token& stop) const {
  using std::chrono::steady_clock;
  constexpr std::chrono::milliseconds longest_sleep(5);
  if (!(speed_ > 0)) return !stop.stop_requested();
  // 30 years at most, so that a very slow pace does not overflow the clock.
  const double wait_s = std::min(static_cast<double>(stream_ps) * 1e-12 / speed_, 1e9);
  const auto due = start_ + std::chrono::duration_cast<steady_clock::duration>(
                                std::chrono::duration<double>(wait_s));
  while (!stop.stop_requested()) {
    const auto left = due - steady_clock::now();
    if (left <= steady_clock::duration::zero()) return true;
    std::this_thread::sleep_for(std::min<steady_clock::duration>(left, longest_sleep));
  }
  return false;
}

}  // namespace splid
