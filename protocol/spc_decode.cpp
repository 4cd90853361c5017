#include "protocol/spc_decode.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <system_error>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/photon_run.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

constexpr std::size_t spc_header_bytes = 4;
constexpr std::uint64_t micro_steps = 4096;
constexpr std::uint64_t macro_wrap = 4096;
constexpr double macro_unit_s = 1e-10;

constexpr std::uint32_t marker_bit = 1U << 28U;
constexpr std::uint32_t gap_bit = 1U << 29U;
constexpr std::uint32_t spc_overflow_bit = 1U << 30U;
constexpr std::uint32_t invalid_bit = 1U << 31U;

[[noreturn]] void refuse_spc(const std::string& what) {
  throw Error(Fault::data, "Becker & Hickl header: " + what);
}

// The value of a setting such as "#SP [SP_TAC_R,F,5.0033e-08]"; absent where there is none.
std::optional<double> setting(std::string_view settings, const std::string& name) {
  const std::size_t at = settings.find("[" + name + ",");
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view text = settings.substr(at, settings.substr(at).find(']'));
  const std::size_t comma = text.rfind(',');
  text = trimmed(text.substr(comma + 1));
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc{}) return std::nullopt;
  return value;
}

double micro_step_s(std::string_view settings) {
  const std::optional<double> range_s = setting(settings, "SP_TAC_R");
  const std::optional<double> gain = setting(settings, "SP_TAC_G");
  if (!range_s || !gain) {
    refuse_spc(
        "a .spc file lacks the length of its micro time steps; save the settings (SP_TAC_R and "
        "SP_TAC_G) beside the recording, under the same name with .set");
  }
  const double step_s = *range_s / *gain / static_cast<double>(micro_steps);
  if (!(step_s >= 1e-15 && step_s <= 1e-3)) {
    refuse_spc("its settings make a step of the micro time " + number_text(step_s) +
               " s long (SP_TAC_R / SP_TAC_G / 4096); it must be from 1e-15 to 1e-3 s");
  }
  return step_s;
}

}  // namespace

std::optional<RecordingHeader> parse_spc_header(std::span<const std::byte> prefix, bool complete,
                                                std::string_view settings) {
  if (prefix.size() < spc_header_bytes) {
    if (!complete) return std::nullopt;
    refuse_spc("the file has " + std::to_string(prefix.size()) + " bytes; its header has 4");
  }
  const std::uint32_t macro_units = little_endian_32(prefix.data()) & 0xFFFFFFU;
  if (macro_units == 0) {
    refuse_spc(
        "a step of the macro time of 0 ns; the file is damaged, or of an SPC-600 or SPC-630");
  }
  RecordingHeader header;
  header.format = RecordingFormat::becker_hickl;
  header.header_bytes = spc_header_bytes;
  header.is_t3 = true;
  header.sync_period_s = macro_units * macro_unit_s;
  header.resolution_s = micro_step_s(settings);
  header.time_steps = micro_steps;
  header.tags.push_back({"HW_Type", -1, PtuTagType::string, std::string("Becker & Hickl SPC"), 0});
  return header;
}

SpcDecoder::SpcDecoder(double period_ps, double resolution_s)
    : clock_(period_ps), step_ps_(step_of_time_ps(resolution_s)) {}

namespace {

// The tags of a record: the begin and the end of a loss, its sync, and its event.
constexpr std::size_t most_spc_tags = 4;

// Three counts of records in one number, which a loop keeps in one register.
constexpr std::uint64_t one_unknown_spc = 1;
constexpr std::uint64_t one_untimed = std::uint64_t{1} << 16U;
constexpr std::uint64_t one_counted = std::uint64_t{1} << 32U;

// What a record is, by its flags and its routing or marker bits.
struct SpcKind {
  TagMeaning meaning;
  std::uint64_t events = 0;        // 1 or 0
  std::uint64_t wraps = 0;         // of the macro time, 1 or 0
  std::uint64_t timed_mask = 0;    // all ones for a photon with a micro time
  std::uint64_t counted_mask = 0;  // where the record holds the number of wraps, and nothing else
  std::uint64_t counts = 0;
};

constexpr SpcKind spc_kind(std::uint32_t record) {
  constexpr std::uint64_t all = ~std::uint64_t{0};
  const auto bits = static_cast<std::int32_t>(record >> 12U & 0xFU);
  const bool is_overflow = (record & spc_overflow_bit) != 0;
  const bool is_invalid = (record & invalid_bit) != 0;
  const std::uint64_t wraps = is_overflow ? 1 : 0;
  if ((record & marker_bit) != 0) {
    if (bits == 0) return {{}, 0, wraps, 0, 0, one_unknown_spc};
    return {{bits, TagKind::marker, {}}, 1, wraps, 0, 0, 0};
  }
  if (is_overflow && is_invalid) return {{}, 0, 0, 0, all, one_counted};
  if (is_invalid) return {untimed_photon(bits), 1, wraps, 0, 0, one_untimed};
  return {{bits, TagKind::photon, {}}, 1, wraps, all, 0, 0};
}

// By bits 31 to 28 and 15 to 12.
constexpr std::array<SpcKind, 256> spc_kinds = [] {
  std::array<SpcKind, 256> kinds{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    kinds[i] = spc_kind(((i >> 4U) << 28U) | ((i & 15U) << 12U));
  }
  return kinds;
}();

// Of photons without a flag, or with that of an overflow of the macro time.
struct SpcPhotons {
  static bool is_other(std::uint32_t record) {
    return (record & (marker_bit | gap_bit | invalid_bit)) != 0;
  }
  static std::uint64_t wraps(std::uint32_t record) {
    return (record & spc_overflow_bit) != 0 ? macro_wrap : 0;
  }
  static std::uint64_t sync(std::uint32_t record) { return record & 0xFFFU; }
  static std::uint64_t ticks(std::uint32_t record) {
    return micro_steps - 1 - (record >> 16U & 0xFFFU);
  }
  static const TagMeaning& meaning(std::uint32_t record) {
    return spc_kinds[record >> 12U & 0xFU].meaning;
  }
  // There are none: a micro time that is not valid has a flag.
  static const TagMeaning& untimed(std::uint32_t record) { return meaning(record); }
};

}  // namespace

// Bits 0 to 11 macro time, 12 to 15 routing or marker bits, 16 to 27 micro time, then the flags
// marker, gap, overflow and invalid. Overflow and invalid without a marker: the low 28 bits count
// overflows, and the record is nothing else.
//
// Design note: as PtuT3Decoder, without a branch on what a record is. Only gaps have a branch, as
// they are rare.
std::size_t SpcDecoder::decode_mixed(const std::byte* in, std::size_t count, Tag* out) {
  // What changes, in registers: a tag is written as bytes, which might be a member's.
  State state = state_;
  const CountedSyncs clock = clock_;
  const double step_ps = step_ps_;
  std::uint64_t counts = 0;
  std::size_t tags = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t record = little_endian_32(in + 4 * i);
    const SpcKind& kind = spc_kinds[(record >> 24U & 0xF0U) | (record >> 12U & 0xFU)];
    state.base += macro_wrap * (kind.wraps | (record & 0xFFFFFFFU & kind.counted_mask));
    counts += kind.counts;
    const bool is_event = kind.events != 0;
    const std::uint64_t here = state.base + (is_event ? record & 0xFFFU : 0);
    const std::int64_t sync_ps = clock.time_ps(here);
    const std::uint64_t micro = SpcPhotons::ticks(record) & kind.timed_mask;
    const std::int64_t since_ps =
        CountedSyncs::rounded(static_cast<double>(static_cast<std::int64_t>(micro)) * step_ps);
    const auto at_ps = static_cast<std::int64_t>(static_cast<std::uint64_t>(sync_ps) +
                                                 static_cast<std::uint64_t>(since_ps));
    if ((record & gap_bit) != 0 && is_event) {
      write_tag(out[tags++], state.last_ps, {0, TagKind::loss_begin, {}});
      write_tag(out[tags++], std::max(sync_ps, state.last_ps), {-1, TagKind::loss_end, {}});
    }
    write_tag(out[tags], sync_ps, {0, TagKind::sync, {}});
    const std::uint64_t told = is_event ? here : state.told;
    tags += told != state.told ? 1 : 0;
    state.told = told;
    state.syncs = (kind.counts & one_unknown_spc) != 0 ? state.syncs : here;
    write_tag(out[tags], at_ps, kind.meaning);
    tags += kind.events;
    state.last_ps = is_event ? at_ps : state.last_ps;
  }
  state.unknown += counts % one_untimed;
  state.untimed += counts / one_untimed % one_untimed;
  state.overflow_records += counts / one_counted;
  state_ = state;
  return tags;
}

std::size_t SpcDecoder::decode_some(const std::byte* in, std::size_t count, Tag* out) {
  // No micro time is too late for a record: its syncs come after its photons.
  const PhotonTimes times{clock_, step_ps_, micro_steps};
  std::size_t tags = 0;
  for (; count >= run_records; count -= run_records, in += record_bytes() * run_records) {
    if (is_photon_run<SpcPhotons>(in)) {
      const auto run =
          write_photon_run<SpcPhotons>(in, times, state_.base, state_.told, out + tags);
      state_.base = run.base;
      state_.told = run.told;
      state_.syncs = run.told;
      tags += run.tags;
      state_.last_ps = out[tags - 1].time_ps;
    } else {
      tags += decode_mixed(in, run_records, out + tags);
    }
  }
  return tags + decode_mixed(in, count, out + tags);
}

RecordDecoder::Progress SpcDecoder::decode(std::span<const std::byte> records, std::span<Tag> out) {
  Progress progress;
  const auto next = [&](std::size_t most) {
    return std::min(most, (records.size() - progress.bytes) / record_bytes());
  };
  const auto drain = [&] {
    while (taken_ < made_count_ && progress.tags < out.size()) {
      out[progress.tags++] = made_[taken_++];
    }
  };
  drain();
  // So many at a time as there is room for in any case.
  while (const std::size_t count = next((out.size() - progress.tags) / most_spc_tags)) {
    progress.tags +=
        decode_some(records.data() + progress.bytes, count, out.data() + progress.tags);
    progress.bytes += count * record_bytes();
  }
  while (progress.tags < out.size() && next(1) > 0) {
    made_count_ = decode_some(records.data() + progress.bytes, 1, made_.data());
    taken_ = 0;
    progress.bytes += record_bytes();
    drain();
  }
  return progress;
}

}  // namespace splid
