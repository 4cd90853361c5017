#include "protocol/ptu_decode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"

namespace splid {
namespace {

__extension__ using Wide = unsigned __int128;

// So many tags at a time are scaled as stay in the first-level cache.
constexpr std::size_t scaled_tags = 1024;

constexpr std::int64_t wrap_hydra_harp = 1 << 25;
constexpr std::int64_t wrap_hydra_harp_v1 = 33'552'000;
constexpr std::int64_t wrap_pico_harp = 210'698'240;

// What to do for a record, by the 7 bits that tell the kinds of records apart.
struct Action {
  TagMeaning meaning;
  std::uint64_t tags = 0;           // to keep: 1 or 0
  std::uint64_t overflows = 0;      // 1 or 0
  std::uint64_t overflow_mask = 0;  // all ones for an overflow
};

constexpr Action tag_action(int value, TagKind kind) { return {{value, kind, {}}, 1, 0, 0}; }
constexpr Action overflow_action{{}, 0, 1, ~std::uint64_t{0}};

// HydraHarp and later: bit 31 special, bits 30 to 25 channel.
constexpr std::array<Action, 128> hydra_harp_actions = [] {
  std::array<Action, 128> actions{};
  for (int channel = 0; channel < 64; ++channel) {
    actions[channel] = tag_action(channel, TagKind::photon);
  }
  actions[64] = tag_action(0, TagKind::sync);
  for (int bits = 1; bits < 16; ++bits) actions[64 + bits] = tag_action(bits, TagKind::marker);
  actions[127] = overflow_action;
  return actions;
}();

// Times in here are unsigned. The times of a damaged file may add up past 2^63; they then wrap
// around, which does no other harm.
struct Clock {
  std::uint64_t base = 0;       // clock at the last overflow
  std::uint64_t unit = 1;       // of a tick
  std::uint64_t wrap = 0;       // of an overflow
  std::uint64_t overflows = 0;  // records
  std::size_t tags = 0;         // written
};

// Design note: there is no branch on what a record is. Overflows and syncs come at random among
// photons, and a wrong guess of the processor costs some 15 cycles, where a whole record costs 5.
// So each record writes 16 bytes, and only those that are tags move the place of the next. A table
// of 4 KB says what to do for a record: working it out each time would take half as long again.
template <bool counted>
Clock decode_hydra_harp(Clock clock, const std::byte* in, std::size_t count, Tag* out) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t record = little_endian_32(in + 4 * i);
    const Action& action = hydra_harp_actions[record >> 25U];
    const std::uint64_t ticks = record & 0x1FFFFFFU;
    const std::uint64_t wraps = counted ? ticks + (ticks == 0 ? 1 : 0) : 1;
    clock.base += action.overflow_mask & (wraps * clock.wrap);
    clock.overflows += action.overflows;
    write_tag(out[clock.tags], static_cast<std::int64_t>(clock.base + ticks * clock.unit),
              action.meaning);
    clock.tags += action.tags;
  }
  return clock;
}

// PicoHarp: bits 31 to 28 are the channel. Channel 15 is special: the low 4 bits of its time are
// the marker bits, and where none is set the record is an overflow.
constexpr std::array<Action, 31> pico_harp_actions = [] {
  std::array<Action, 31> actions{};
  for (int channel = 0; channel < 15; ++channel) {
    actions[channel] = tag_action(channel, TagKind::photon);
  }
  actions[15] = overflow_action;
  for (int bits = 1; bits < 16; ++bits) actions[15 + bits] = tag_action(bits, TagKind::marker);
  return actions;
}();

Clock decode_pico_harp(Clock clock, const std::byte* in, std::size_t count, Tag* out) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t record = little_endian_32(in + 4 * i);
    const std::uint32_t channel = record >> 28U;
    const std::uint32_t bits = record & (channel == 15 ? 15U : 0U);
    const Action& action = pico_harp_actions[channel + bits];
    const std::uint64_t ticks = (record & 0xFFFFFFFU) - bits;
    clock.base += action.overflow_mask & clock.wrap;
    clock.overflows += action.overflows;
    write_tag(out[clock.tags], static_cast<std::int64_t>(clock.base + ticks * clock.unit),
              action.meaning);
    clock.tags += action.tags;
  }
  return clock;
}

std::int64_t wrap_of(RecordType type) {
  switch (type) {
    case RecordType::pico_harp:
      return wrap_pico_harp;
    case RecordType::hydra_harp_v1:
      return wrap_hydra_harp_v1;
    case RecordType::time_harp_260_nano:
    case RecordType::time_harp_260_pico:
    case RecordType::generic:
    case RecordType::hydra_harp_v2:
      break;
    case RecordType::pico_harp_t3:
    case RecordType::hydra_harp_v1_t3:
    case RecordType::time_harp_260_nano_t3:
    case RecordType::time_harp_260_pico_t3:
    case RecordType::generic_t3:
    case RecordType::hydra_harp_v2_t3:
      throw Error(Fault::data, "PTU records: T3 is decoded by PtuT3Decoder");
  }
  return wrap_hydra_harp;
}

// Two whole numbers.
struct Fraction {
  double numerator;
  double denominator;
};

// The simplest fraction that is `value` to within a few roundings of a double: 125/32 for 3.90625,
// by continued fractions.
//
// Design note: denominators stay below 2^20 and below the square root of 2^62 / value, so that
// numerator times denominator, which to_ps() needs, fits into 64 bits.
Fraction fraction_of(double value) {
  const double max_denominator = std::min(1048576.0, std::sqrt(std::ldexp(1.0, 62) / value));
  Fraction before{1, 0};
  Fraction best{std::floor(value), 1};
  double rest = value - std::floor(value);
  while (std::abs(best.numerator - value * best.denominator) > 1e-15 * value * best.denominator) {
    const double inverse = 1 / rest;
    const double term = std::floor(inverse);
    const Fraction next{term * best.numerator + before.numerator,
                        term * best.denominator + before.denominator};
    if (!(next.denominator <= max_denominator)) break;
    before = best;
    best = next;
    rest = inverse - term;
  }
  return best;
}

}  // namespace

PtuDecoder::PtuDecoder(RecordType type, double resolution_s, std::int64_t origin_ps,
                       const PtuInputs& inputs)
    : type_(type),
      inputs_(inputs),
      has_other_inputs_(!inputs.text().empty()),
      origin_ps_(origin_ps) {
  if (!(resolution_s >= 1e-15 && resolution_s <= 1e-3)) {
    throw Error(Fault::data, "PTU records: a resolution of " + number_text(resolution_s) +
                                 " s; it must be from 1e-15 to 1e-3 s");
  }
  wrap_ = wrap_of(type);
  const Fraction ps = fraction_of(resolution_s * 1e12);
  numerator_ = static_cast<std::int64_t>(ps.numerator);
  denominator_ = static_cast<std::int64_t>(ps.denominator);
  const auto denominator = static_cast<Wide>(denominator_);
  const auto in_2_64ths = [&](std::int64_t part) {
    return static_cast<std::uint64_t>(((static_cast<Wide>(part) << 64U) + denominator - 1) /
                                      denominator);
  };
  whole_ps_ = static_cast<std::uint64_t>(numerator_ / denominator_);
  fraction_ = in_2_64ths(numerator_ % denominator_);
  half_ = in_2_64ths(denominator_ / 2);
}

RecordDecoder::Progress PtuDecoder::decode(std::span<const std::byte> records, std::span<Tag> out) {
  const bool whole = denominator_ == 1;
  const std::size_t most = whole ? out.size() : scaled_tags;
  Progress progress;
  // A record writes at most one tag: so many at a time as there is room for in any case.
  while (true) {
    const auto rest = records.subspan(progress.bytes);
    const auto room = out.subspan(progress.tags, std::min(most, out.size() - progress.tags));
    const std::size_t count = std::min(rest.size() / ptu_record_bytes, room.size());
    if (count == 0) return progress;
    const std::uint64_t before = base_;
    const std::size_t tags = decode_some(rest.data(), count, room.data());
    if (!whole) scale(room.first(tags), before);
    if (has_other_inputs_) name_inputs(room.first(tags));
    progress.bytes += count * ptu_record_bytes;
    progress.tags += tags;
  }
}

std::size_t PtuDecoder::decode_some(const std::byte* in, std::size_t count, Tag* out) {
  const bool whole = denominator_ == 1;
  const auto origin = static_cast<std::uint64_t>(whole ? origin_ps_ : 0);
  Clock clock;
  clock.unit = static_cast<std::uint64_t>(whole ? numerator_ : 1);
  clock.wrap = static_cast<std::uint64_t>(wrap_) * clock.unit;
  clock.base = base_ + origin;
  if (type_ == RecordType::pico_harp) {
    clock = decode_pico_harp(clock, in, count, out);
  } else if (type_ == RecordType::hydra_harp_v1) {
    clock = decode_hydra_harp<false>(clock, in, count, out);
  } else {
    clock = decode_hydra_harp<true>(clock, in, count, out);
  }
  base_ = clock.base - origin;
  overflow_records_ += clock.overflows;
  unknown_records_ += count - clock.tags - clock.overflows;
  return clock.tags;
}

void PtuDecoder::name_inputs(std::span<Tag> tags) const {
  for (Tag& tag : tags) {
    if (tag.kind != TagKind::photon) continue;
    tag.value = inputs_.input_of(static_cast<std::size_t>(tag.value));
  }
}

std::int64_t PtuDecoder::reached_ps() const {
  if (denominator_ != 1) return to_ps(static_cast<std::int64_t>(base_));
  return static_cast<std::int64_t>(base_ + static_cast<std::uint64_t>(origin_ps_));
}

std::int64_t PtuDecoder::to_ps(std::int64_t ticks) const {
  const std::int64_t rest = ticks % denominator_;
  const auto whole = static_cast<std::uint64_t>(ticks / denominator_);
  const std::int64_t part = (rest * numerator_ + denominator_ / 2) / denominator_;
  return static_cast<std::int64_t>(whole * static_cast<std::uint64_t>(numerator_) +
                                   static_cast<std::uint64_t>(part) +
                                   static_cast<std::uint64_t>(origin_ps_));
}

// Design note: a division for each tag would take three times as long as all the rest. So the ticks
// since a time that is a whole number of ps are multiplied by ps a tick, whose fraction is a number
// of 2^-64 ps. It and the half that rounds are themselves rounded up, by less than 1 each, so that
// the sum is too large by less than (ticks + 1) / 2^64. A sum between two whole numbers is at least
// 1 / denominator, or 2^-20, below the upper one: of fewer than 2^43 ticks its whole part is exact.
void PtuDecoder::scale(std::span<Tag> tags, std::uint64_t first_ticks) const {
  const auto denominator = static_cast<std::uint64_t>(denominator_);
  const std::uint64_t anchor = first_ticks - first_ticks % denominator;
  const bool is_early = first_ticks < std::uint64_t{1} << 62U;
  const auto anchor_ps = static_cast<std::uint64_t>(to_ps(static_cast<std::int64_t>(anchor)));
  for (Tag& tag : tags) {
    const std::uint64_t ticks = static_cast<std::uint64_t>(tag.time_ps) - anchor;
    if (is_early && ticks < std::uint64_t{1} << 43U) {
      const auto part = (static_cast<Wide>(ticks) * fraction_ + half_) >> 64U;
      tag.time_ps = static_cast<std::int64_t>(anchor_ps + ticks * whole_ps_ +
                                              static_cast<std::uint64_t>(part));
    } else {
      tag.time_ps = to_ps(tag.time_ps);
    }
  }
}

}  // namespace splid
