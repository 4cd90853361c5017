#include "protocol/ptu_t3_decode.hpp"

#include <algorithm>
#include <array>

#include "protocol/photon_run.hpp"

namespace splid {
namespace {

constexpr std::uint64_t hydra_harp_syncs = 1024;
constexpr std::uint64_t pico_harp_syncs = 65'536;
// The tags of a record: its sync, where it is the first of its period, and its event.
constexpr std::size_t most_tags = 2;

// Two counts of records in one number, which a loop keeps in one register.
constexpr std::uint64_t one_unknown = 1;
constexpr std::uint64_t one_overflow = std::uint64_t{1} << 32U;

// What a record is, by the bits that tell the kinds of records apart.
struct T3Kind {
  TagMeaning meaning;
  TagMeaning untimed;               // of a photon of the largest time
  std::uint64_t events = 0;         // 1 or 0
  std::uint64_t photons = 0;        // 1 or 0
  std::uint64_t overflow_mask = 0;  // all ones for an overflow
  std::uint64_t counts = 0;
};

constexpr T3Kind photon_kind(int input) {
  return {{input, TagKind::photon, {}}, untimed_photon(input), 1, 1, 0, 0};
}
constexpr T3Kind marker_kind(int bits) { return {{bits, TagKind::marker, {}}, {}, 1, 0, 0, 0}; }
constexpr T3Kind overflow_kind{{}, {}, 0, 0, ~std::uint64_t{0}, one_overflow};
constexpr T3Kind unknown_kind{{}, {}, 0, 0, 0, one_unknown};

struct T3Record {
  const T3Kind& kind;
  std::uint64_t ticks;      // since its sync
  std::uint64_t sync;       // low bits of its number
  std::uint64_t overflows;  // that it stands for, if it is an overflow
};

// HydraHarp and later: bit 31 special, bits 30 to 25 channel.
constexpr std::array<T3Kind, 128> t3_hydra_harp_kinds = [] {
  std::array<T3Kind, 128> kinds{};
  for (int channel = 0; channel < 64; ++channel) {
    kinds[channel] = photon_kind(channel);
    kinds[64 + channel] = unknown_kind;
  }
  for (int bits = 1; bits < 16; ++bits) kinds[64 + bits] = marker_kind(bits);
  kinds[127] = overflow_kind;
  return kinds;
}();

// Bits 24 to 10 time, 9 to 0 sync. An overflow has their count in place of the sync, and a count of
// 0 is one; an old recorder writes a record for each overflow, and no count.
template <bool counted>
struct HydraHarpT3 {
  static constexpr std::uint64_t syncs_in_overflow = hydra_harp_syncs;

  static bool is_other(std::uint32_t record) { return record >> 31U != 0; }
  static std::uint64_t wraps(std::uint32_t /*photon*/) { return 0; }
  static std::uint64_t sync(std::uint32_t record) { return record & 0x3FFU; }
  static std::uint64_t ticks(std::uint32_t record) { return record >> 10U & 0x7FFFU; }
  static const TagMeaning& meaning(std::uint32_t photon) {
    return t3_hydra_harp_kinds[photon >> 25U].meaning;
  }
  static const TagMeaning& untimed(std::uint32_t photon) {
    return t3_hydra_harp_kinds[photon >> 25U].untimed;
  }
  static T3Record read(std::uint32_t record) {
    const std::uint64_t overflows = sync(record) + (sync(record) == 0 ? 1 : 0);
    return {t3_hydra_harp_kinds[record >> 25U], ticks(record), sync(record),
            counted ? overflows : 1};
  }
};

constexpr std::array<T3Kind, 31> t3_pico_harp_kinds = [] {
  std::array<T3Kind, 31> kinds{};
  for (int channel = 0; channel < 15; ++channel) kinds[channel] = photon_kind(channel);
  kinds[15] = overflow_kind;
  for (int bits = 1; bits < 16; ++bits) kinds[15 + bits] = marker_kind(bits);
  return kinds;
}();

// Bits 31 to 28 channel, 27 to 16 time, 15 to 0 sync. Channel 15 is special: the low 4 bits of its
// time are the marker bits, and where none is set the record is an overflow.
struct PicoHarpT3 {
  static constexpr std::uint64_t syncs_in_overflow = pico_harp_syncs;

  static bool is_other(std::uint32_t record) { return record >= 15U << 28U; }
  static std::uint64_t wraps(std::uint32_t /*photon*/) { return 0; }
  static std::uint64_t sync(std::uint32_t record) { return record & 0xFFFFU; }
  static std::uint64_t ticks(std::uint32_t record) { return record >> 16U & 0xFFFU; }
  static const TagMeaning& meaning(std::uint32_t photon) {
    return t3_pico_harp_kinds[photon >> 28U].meaning;
  }
  static const TagMeaning& untimed(std::uint32_t photon) {
    return t3_pico_harp_kinds[photon >> 28U].untimed;
  }
  static T3Record read(std::uint32_t record) {
    const std::uint32_t channel = record >> 28U;
    const bool is_special = channel == 15;
    const std::uint64_t bits = is_special ? ticks(record) & 15U : 0;
    return {t3_pico_harp_kinds[channel + bits], is_special ? 0 : ticks(record), sync(record), 1};
  }
};

}  // namespace

PtuT3Decoder::PtuT3Decoder(RecordType type, double period_ps, double resolution_s)
    : type_(type),
      clock_(period_ps),
      tick_ps_(step_of_time_ps(resolution_s)),
      most_ticks_(t3_time_steps(type) - 1) {}

std::int64_t PtuT3Decoder::reached_ps() const {
  const bool has_sync = state_.told != no_sync && state_.told > state_.base;
  return clock_.time_ps(has_sync ? state_.told : state_.base);
}

// Design note: as PtuDecoder, without a branch on what a record is. Each writes 32 bytes, and only
// those that are tags move the place of the next.
template <class Format>
std::size_t PtuT3Decoder::decode_mixed(const std::byte* in, std::size_t count, Tag* out) {
  // What changes, in registers: a tag is written as bytes, which might be a member's.
  State state = state_;
  const CountedSyncs clock = clock_;
  const double tick_ps = tick_ps_;
  const std::uint64_t most_ticks = most_ticks_;
  std::uint64_t counts = 0;
  std::size_t tags = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const T3Record record = Format::read(little_endian_32(in + ptu_record_bytes * i));
    const T3Kind& kind = record.kind;
    state.base += record.overflows * Format::syncs_in_overflow & kind.overflow_mask;
    counts += kind.counts;
    const std::uint64_t syncs = state.base + record.sync;
    const std::int64_t sync_ps = clock.time_ps(syncs);
    write_tag(out[tags], sync_ps, {0, TagKind::sync, {}});
    const std::uint64_t told = kind.events != 0 ? syncs : state.told;
    tags += told != state.told ? 1 : 0;
    state.told = told;
    const std::int64_t since_ps = CountedSyncs::rounded(
        static_cast<double>(static_cast<std::int64_t>(record.ticks)) * tick_ps);
    const auto at_ps = static_cast<std::int64_t>(static_cast<std::uint64_t>(sync_ps) +
                                                 static_cast<std::uint64_t>(since_ps));
    const bool is_saturated = record.ticks == most_ticks && kind.photons != 0;
    state.saturated += is_saturated ? 1 : 0;
    write_tag(out[tags], at_ps, is_saturated ? kind.untimed : kind.meaning);
    tags += kind.events;
  }
  state.unknown += counts % one_overflow;
  state.overflows += counts / one_overflow;
  state_ = state;
  return tags;
}

template <class Format>
std::size_t PtuT3Decoder::decode_some(const std::byte* in, std::size_t count, Tag* out) {
  const PhotonTimes times{clock_, tick_ps_, most_ticks_};
  std::size_t tags = 0;
  for (; count >= run_records; count -= run_records, in += ptu_record_bytes * run_records) {
    if (is_photon_run<Format>(in)) {
      const auto run = write_photon_run<Format>(in, times, state_.base, state_.told, out + tags);
      state_.told = run.told;
      state_.saturated += run.saturated;
      tags += run.tags;
    } else {
      tags += decode_mixed<Format>(in, run_records, out + tags);
    }
  }
  return tags + decode_mixed<Format>(in, count, out + tags);
}

std::size_t PtuT3Decoder::decode_records(const std::byte* in, std::size_t count, Tag* out) {
  switch (type_) {
    case RecordType::pico_harp_t3:
      return decode_some<PicoHarpT3>(in, count, out);
    case RecordType::hydra_harp_v1_t3:
      return decode_some<HydraHarpT3<false>>(in, count, out);
    default:
      return decode_some<HydraHarpT3<true>>(in, count, out);
  }
}

RecordDecoder::Progress PtuT3Decoder::decode(std::span<const std::byte> records,
                                             std::span<Tag> out) {
  Progress progress;
  if (waiting_ && !out.empty()) {
    out[progress.tags++] = *waiting_;
    waiting_.reset();
  }
  const auto next = [&](std::size_t most) {
    return std::min(most, (records.size() - progress.bytes) / ptu_record_bytes);
  };
  // So many at a time as there is room for in any case.
  while (const std::size_t count = next((out.size() - progress.tags) / most_tags)) {
    progress.tags +=
        decode_records(records.data() + progress.bytes, count, out.data() + progress.tags);
    progress.bytes += count * ptu_record_bytes;
  }
  while (progress.tags < out.size() && next(1) > 0) {
    std::array<Tag, most_tags> tags{};
    const std::size_t count = decode_records(records.data() + progress.bytes, 1, tags.data());
    progress.bytes += ptu_record_bytes;
    if (count > 0) out[progress.tags++] = tags[0];
    if (count > 1) waiting_ = tags[1];
  }
  return progress;
}

}  // namespace splid
