#include "protocol/ptu_t3_decode.hpp"

#include <string>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"

namespace splid {
namespace {

constexpr int overflow_channel = 63;
constexpr std::uint64_t hydra_harp_syncs = 1024;
constexpr std::uint64_t pico_harp_syncs = 65'536;
constexpr std::uint64_t hydra_harp_most_ticks = 0x7FFF;
constexpr std::uint64_t pico_harp_most_ticks = 0xFFF;

std::uint32_t t3_record_at(const std::byte* bytes) {
  std::uint32_t record = 0;
  for (int i = 3; i >= 0; --i) record = (record << 8U) | std::to_integer<std::uint32_t>(bytes[i]);
  return record;
}

// Of a number that is not negative. A call of std::llround() for each record takes longer than all
// the rest.
std::int64_t rounded(double value) {
  return static_cast<std::int64_t>(value + 0.5);  // NOLINT(bugprone-incorrect-roundings): see above
}

[[noreturn]] void refuse(const char* what, double value, const char* bounds) {
  throw Error(Fault::data, std::string("PTU records, T3: ") + what + " of " + number_text(value) +
                               " ps; it must be " + bounds);
}

}  // namespace

PtuT3Decoder::PtuT3Decoder(PtuRecordType type, double period_ps, double resolution_s)
    : type_(type),
      tick_ps_(resolution_s * 1e12),
      most_ticks_(type == PtuRecordType::pico_harp_t3 ? pico_harp_most_ticks
                                                      : hydra_harp_most_ticks),
      syncs_in_overflow_(type == PtuRecordType::pico_harp_t3 ? pico_harp_syncs : hydra_harp_syncs) {
  if (!(period_ps >= 1 && period_ps <= 1e12)) {
    refuse("a time between syncs", period_ps, "from 1 to 1e12 ps");
  }
  if (!(tick_ps_ >= 1e-3 && tick_ps_ <= 1e9)) {
    refuse("a resolution", tick_ps_, "from 1e-3 to 1e9 ps");
  }
  whole_period_ps_ = static_cast<std::int64_t>(period_ps);
  rest_of_period_ps_ = period_ps - static_cast<double>(whole_period_ps_);
}

// The number times the period, to a tenth of a picosecond up to 1e12 syncs. Unsigned, since the
// numbers of a damaged file may be anything.
std::int64_t PtuT3Decoder::sync_time_ps(std::uint64_t number) const {
  constexpr std::uint64_t at_most = (std::uint64_t{1} << 53U) - 1;
  const double rest_ps = static_cast<double>(number & at_most) * rest_of_period_ps_;
  const std::uint64_t whole_ps = number * static_cast<std::uint64_t>(whole_period_ps_);
  return static_cast<std::int64_t>(whole_ps + static_cast<std::uint64_t>(rounded(rest_ps)));
}

// Bits 31 to 28 channel, 27 to 16 time, 15 to 0 sync. Channel 15 is special: its time has the
// marker bits, and where none is set the record is an overflow.
PtuT3Decoder::Fields PtuT3Decoder::pico_harp_fields(std::uint32_t record) const {
  Fields fields;
  fields.sync = record & 0xFFFFU;
  fields.ticks = record >> 16U & 0xFFFU;
  fields.value = static_cast<int>(record >> 28U);
  if (fields.value != 15) return fields;
  fields.value = static_cast<int>(std::exchange(fields.ticks, 0) & 0xFU);
  fields.kind = TagKind::marker;
  fields.is_overflow = fields.value == 0;
  if (fields.is_overflow) fields.sync = 1;
  return fields;
}

// Bit 31 special, bits 30 to 25 channel, 24 to 10 time, 9 to 0 sync.
PtuT3Decoder::Fields PtuT3Decoder::hydra_harp_fields(std::uint32_t record) const {
  Fields fields;
  fields.sync = record & 0x3FFU;
  fields.ticks = record >> 10U & 0x7FFFU;
  fields.value = static_cast<int>(record >> 25U & 0x3FU);
  if (record >> 31U == 0) return fields;
  fields.kind = TagKind::marker;
  fields.is_overflow = fields.value == overflow_channel;
  fields.is_unknown = !fields.is_overflow && (fields.value == 0 || fields.value > 15);
  // An old recorder writes a record for each overflow and no count; a count of 0 is one overflow.
  const bool is_single = type_ == PtuRecordType::hydra_harp_v1_t3 || fields.sync == 0;
  if (fields.is_overflow && is_single) fields.sync = 1;
  return fields;
}

PtuT3Decoder::Fields PtuT3Decoder::fields_of(std::uint32_t record) const {
  return type_ == PtuRecordType::pico_harp_t3 ? pico_harp_fields(record)
                                              : hydra_harp_fields(record);
}

Tag PtuT3Decoder::event_of(const Fields& fields) {
  const std::int64_t since_ps = rounded(static_cast<double>(fields.ticks) * tick_ps_);
  const auto at_ps = static_cast<std::int64_t>(static_cast<std::uint64_t>(sync_ps_) +
                                               static_cast<std::uint64_t>(since_ps));
  if (fields.kind == TagKind::photon && fields.ticks == most_ticks_) {
    ++saturated_photons_;
    return {at_ps, 1, TagKind::missed, {}};
  }
  return {at_ps, fields.value, fields.kind, {}};
}

std::size_t PtuT3Decoder::put(const Fields& fields, std::span<Tag> out) {
  syncs_ = base_ + fields.sync;
  std::size_t written = 0;
  if (told_ != syncs_) {
    sync_ps_ = reached_ps();
    out[written++] = sync_tag(sync_ps_);
    told_ = syncs_;
  }
  const Tag event = event_of(fields);
  if (written < out.size()) {
    out[written++] = event;
  } else {
    waiting_ = event;
  }
  return written;
}

PtuDecoder::Progress PtuT3Decoder::decode(std::span<const std::byte> records, std::span<Tag> out) {
  PtuDecoder::Progress progress;
  if (waiting_ && !out.empty()) {
    out[progress.tags++] = *waiting_;
    waiting_.reset();
  }
  while (progress.tags < out.size() && records.size() - progress.bytes >= record_bytes) {
    const Fields fields = fields_of(t3_record_at(records.data() + progress.bytes));
    progress.bytes += record_bytes;
    if (fields.is_overflow) {
      base_ += fields.sync * syncs_in_overflow_;
      syncs_ = base_;
      ++overflow_records_;
    } else if (fields.is_unknown) {
      ++unknown_records_;
    } else {
      progress.tags += put(fields, out.subspan(progress.tags));
    }
  }
  return progress;
}

}  // namespace splid
