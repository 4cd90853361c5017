#include "daemon/base/clock.hpp"

#include <chrono>

namespace splid {
namespace {

class HostClock : public Clock {
 public:
  [[nodiscard]] double unix_s() const override {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration<double>(now).count();
  }
  [[nodiscard]] std::int64_t steady_ns() const override {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  }
};

}  // namespace

const Clock& host_clock() {
  static const HostClock clock;
  return clock;
}

}  // namespace splid
