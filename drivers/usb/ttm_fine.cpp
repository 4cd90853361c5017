#include "drivers/usb/ttm_fine.hpp"

#include <algorithm>

namespace splid::usb {
namespace {

// A clock period, 1 / 240 MHz, is 12500 / 3 ps.
constexpr std::int64_t three_periods_ps = 12'500;
constexpr std::int32_t tap_ps = 48;
constexpr std::uint32_t most_hits = 1 << 20;

}  // namespace

TtmFine::TtmFine() {
  constexpr auto period_ps = static_cast<std::int32_t>(three_periods_ps / 3);
  for (std::size_t code = 0; code < table_ps_.size(); ++code) {
    table_ps_.at(code) = std::min(static_cast<std::int32_t>(code) * tap_ps + tap_ps / 2, period_ps);
  }
}

void TtmFine::calibrate() {
  std::int64_t twice_before = 0;
  for (std::size_t code = 0; code < hits_.size(); ++code) {
    const std::int64_t hits = hits_.at(code);
    const std::int64_t middle = twice_before + hits;
    table_ps_.at(code) =
        static_cast<std::int32_t>(middle * three_periods_ps / (std::int64_t{6} * count_));
    twice_before += 2 * hits;
  }
  if (count_ >= most_hits) {
    count_ = 0;
    for (std::uint32_t& hits : hits_) {
      hits /= 2;
      count_ += hits;
    }
  }
  next_ = std::min(2 * count_, most_hits);
}

}  // namespace splid::usb
