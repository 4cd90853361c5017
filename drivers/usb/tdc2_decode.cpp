#include "drivers/usb/tdc2_decode.hpp"

#include <bit>
#include <cstring>

namespace splid::usb {
namespace {

constexpr unsigned time_shift = 10;
constexpr std::uint64_t dummy_bit = 1U << 4U;
constexpr std::uint64_t input_bits = 0xF;

constexpr std::int64_t units_per_ms = 256'000'000;
constexpr std::int64_t units_per_s = 1000 * units_per_ms;
constexpr int strays_of_a_new_clock = 64;

// How near two records must be to show that a stream is no longer adrift. Of random records 1 pair
// in 10^7 is as near.
constexpr std::int64_t most_apart = 20 * units_per_ms;

// 53 days, half of the time that 64 bits of ps hold.
constexpr std::int64_t last_ps = std::int64_t{1} << 62U;
constexpr std::int64_t last_units = last_ps / 125 * 32;

// A mask with one of 32 bits set, for the value of the record's internal bits.
std::uint32_t internal_bit(std::uint64_t record) { return 1U << ((record >> 5U) & 31U); }

std::uint64_t record_at(const std::byte* bytes) {
  std::uint64_t record = 0;
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(&record, bytes, sizeof record);
  } else {
    for (int i = 7; i >= 0; --i) record = (record << 8U) | std::to_integer<std::uint64_t>(bytes[i]);
  }
  return record;
}

// A unit is 125/32 ps. units: 0 to last_units.
std::int64_t to_ps(std::int64_t units) { return units / 32 * 125 + (units % 32 * 125 + 16) / 32; }

// From one 54-bit time to another, the shorter way around.
std::int64_t step_between(std::uint64_t from, std::uint64_t to) {
  return static_cast<std::int64_t>((to - from) << time_shift) >> time_shift;
}

}  // namespace

Tdc2Decoder::Progress Tdc2Decoder::decode(std::span<const std::byte> bytes, std::span<Tag> out) {
  std::size_t used = 0;
  Tag* tag = out.data();
  const Tag* const full = tag + out.size();
  while (bytes.size() - used >= record_bytes && full - tag >= std::ptrdiff_t{most_tags_a_record}) {
    const std::uint64_t record = record_at(bytes.data() + used);
    used += record_bytes;
    if (record != 0) tag = take(record, tag);
  }
  return {used, static_cast<std::size_t>(tag - out.data())};
}

Tag* Tdc2Decoder::take(std::uint64_t record, Tag* out) {
  const std::uint64_t units = record >> time_shift;
  if (!reached_ps_) begin_at(units);
  const std::int64_t step = step_between(latest_units_, units);
  std::int64_t behind = 0;
  if (!fits(units, step)) {
    *out++ = {*reached_ps_, 1, TagKind::missed, {}};
    count_stray(record);
    if (agreeing_strays_ < strays_of_a_new_clock) {
      if (strays_in_row_ == adrift_from) *out++ = {*reached_ps_, 0, TagKind::loss_begin, {}};
      return out;
    }
    *out++ = {*reached_ps_, 0, TagKind::clock_break, {}};
    begin_at(units);
    strays_in_row_ = 0;
  } else if (step < 0) {
    behind = -step;
  } else {
    latest_units_ = units;
    since_origin_ += step;
    if (since_origin_ > last_units) {
      *out++ = {*reached_ps_, 0, TagKind::clock_break, {}};
      since_origin_ = 0;
    }
  }
  internals_ |= internal_bit(record);
  reached_ps_ = to_ps(since_origin_);
  if (is_adrift()) *out++ = {*reached_ps_, -1, TagKind::loss_end, {}};
  strays_in_row_ = 0;
  const std::int64_t time_ps = to_ps(since_origin_ - behind);
  if ((record & dummy_bit) != 0) {
    *out++ = heartbeat_tag(time_ps);
    return out;
  }
  for (std::uint64_t inputs = record & input_bits; inputs != 0; inputs &= inputs - 1) {
    *out++ = photon_tag(time_ps, std::countr_zero(inputs) + 1);
  }
  return out;
}

bool Tdc2Decoder::fits(std::uint64_t units, std::int64_t step) const {
  if (!is_possible(step)) return false;
  if (!is_adrift()) return true;
  const std::int64_t since_stray = step_between(stray_units_, units);
  return since_stray >= -units_per_ms && since_stray <= most_apart;
}

// Design note: records that are read with some bytes missing can look like a clock that runs too
// fast. But their internal bits then have other values than in good records, where they are 24
// or 25.
void Tdc2Decoder::count_stray(std::uint64_t record) {
  const std::uint64_t units = record >> time_shift;
  const std::int64_t step = step_between(stray_units_, units);
  const bool agrees = strays_in_row_ > 0 && step >= -units_per_ms && step <= units_per_s &&
                      (internals_ & internal_bit(record)) != 0;
  agreeing_strays_ = agrees ? agreeing_strays_ + 1 : 1;
  ++strays_in_row_;
  ++strays_;
  stray_units_ = units;
}

bool Tdc2Decoder::is_possible(std::int64_t step) const {
  if (step < 0) return step >= -units_per_ms && since_origin_ + step >= 0;
  // Beyond the largest time that tags hold, the origin moves, and the horizon does not apply.
  if (since_origin_ + step > last_units) return true;
  return to_ps(since_origin_ + step) <= horizon_ps_;
}

void Tdc2Decoder::begin_at(std::uint64_t units) {
  latest_units_ = units;
  since_origin_ = static_cast<std::int64_t>(units);
  reached_ps_ = to_ps(since_origin_);
}

}  // namespace splid::usb
