#include "protocol/spc_decode.hpp"

#include <algorithm>
#include <charconv>
#include <string>
#include <system_error>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"
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
        "a .spc file does not say how long a step of its micro time is, and no settings file "
        "beside it does (the same name with .set, and in it SP_TAC_R and SP_TAC_G); save the "
        "settings beside the recording");
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

void SpcDecoder::push(std::int64_t time_ps, const TagMeaning& meaning) {
  write_tag(made_[made_count_++], time_ps, meaning);
}

// Bits 0 to 11 macro time, 12 to 15 routing or marker bits, 16 to 27 micro time, then the flags
// marker, gap, overflow and invalid. Overflow and invalid without a marker: the low 28 bits count
// overflows, and the record is nothing else.
void SpcDecoder::take(std::uint32_t record) {
  const bool is_marker = (record & marker_bit) != 0;
  const bool is_invalid = (record & invalid_bit) != 0;
  if ((record & spc_overflow_bit) != 0 && is_invalid && !is_marker) {
    base_ += macro_wrap * (record & 0xFFFFFFFU);
    syncs_ = base_;
    ++overflow_records_;
    return;
  }
  if ((record & spc_overflow_bit) != 0) base_ += macro_wrap;
  const auto bits = static_cast<std::int32_t>(record >> 12U & 0xFU);
  if (is_marker && bits == 0) {
    ++unknown_records_;
    return;
  }
  syncs_ = base_ + (record & 0xFFFU);
  const std::int64_t sync_ps = reached_ps();
  const auto micro = static_cast<double>(micro_steps - 1 - (record >> 16U & 0xFFFU));
  const std::int64_t since_ps = is_marker ? 0 : CountedSyncs::rounded(micro * step_ps_);
  const auto at_ps = static_cast<std::int64_t>(static_cast<std::uint64_t>(sync_ps) +
                                               static_cast<std::uint64_t>(since_ps));
  if ((record & gap_bit) != 0) {
    push(last_ps_, {0, TagKind::loss_begin, {}});
    push(std::max(sync_ps, last_ps_), {-1, TagKind::loss_end, {}});
  }
  if (told_ != syncs_) {
    push(sync_ps, {0, TagKind::sync, {}});
    told_ = syncs_;
  }
  if (is_marker) {
    push(at_ps, {bits, TagKind::marker, {}});
  } else if (is_invalid) {
    ++untimed_photons_;
    push(sync_ps, {1, TagKind::missed, {}});
  } else {
    push(at_ps, {bits, TagKind::photon, {}});
  }
  last_ps_ = at_ps;
}

RecordDecoder::Progress SpcDecoder::decode(std::span<const std::byte> records, std::span<Tag> out) {
  Progress progress;
  for (;;) {
    while (taken_ < made_count_ && progress.tags < out.size()) {
      out[progress.tags++] = made_[taken_++];
    }
    if (progress.tags == out.size() || records.size() - progress.bytes < record_bytes()) break;
    made_count_ = taken_ = 0;
    take(little_endian_32(records.data() + progress.bytes));
    progress.bytes += record_bytes();
  }
  return progress;
}

}  // namespace splid
