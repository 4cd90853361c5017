#include "protocol/ptu_t3_decode.hpp"

#include <utility>

namespace splid {
namespace {

constexpr int overflow_channel = 63;
constexpr std::uint64_t hydra_harp_syncs = 1024;
constexpr std::uint64_t pico_harp_syncs = 65'536;

}  // namespace

PtuT3Decoder::PtuT3Decoder(RecordType type, double period_ps, double resolution_s)
    : type_(type),
      clock_(period_ps),
      tick_ps_(step_of_time_ps(resolution_s)),
      most_ticks_(t3_time_steps(type) - 1),
      syncs_in_overflow_(type == RecordType::pico_harp_t3 ? pico_harp_syncs : hydra_harp_syncs) {}

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
  const bool is_single = type_ == RecordType::hydra_harp_v1_t3 || fields.sync == 0;
  if (fields.is_overflow && is_single) fields.sync = 1;
  return fields;
}

PtuT3Decoder::Fields PtuT3Decoder::fields_of(std::uint32_t record) const {
  return type_ == RecordType::pico_harp_t3 ? pico_harp_fields(record) : hydra_harp_fields(record);
}

void PtuT3Decoder::write_event(const Fields& fields, Tag& out) {
  const std::int64_t since_ps = CountedSyncs::rounded(static_cast<double>(fields.ticks) * tick_ps_);
  const auto at_ps = static_cast<std::int64_t>(static_cast<std::uint64_t>(sync_ps_) +
                                               static_cast<std::uint64_t>(since_ps));
  if (fields.kind == TagKind::photon && fields.ticks == most_ticks_) {
    ++saturated_photons_;
    write_tag(out, at_ps, {1, TagKind::missed, {}});
  } else {
    write_tag(out, at_ps, {fields.value, fields.kind, {}});
  }
}

std::size_t PtuT3Decoder::put(const Fields& fields, std::span<Tag> out) {
  syncs_ = base_ + fields.sync;
  std::size_t written = 0;
  if (told_ != syncs_) {
    sync_ps_ = reached_ps();
    write_tag(out[written++], sync_ps_, {0, TagKind::sync, {}});
    told_ = syncs_;
  }
  if (written < out.size()) {
    write_event(fields, out[written++]);
  } else {
    write_event(fields, waiting_.emplace());
  }
  return written;
}

RecordDecoder::Progress PtuT3Decoder::decode(std::span<const std::byte> records,
                                             std::span<Tag> out) {
  Progress progress;
  if (waiting_ && !out.empty()) {
    out[progress.tags++] = *waiting_;
    waiting_.reset();
  }
  while (progress.tags < out.size() && records.size() - progress.bytes >= ptu_record_bytes) {
    const Fields fields = fields_of(little_endian_32(records.data() + progress.bytes));
    progress.bytes += ptu_record_bytes;
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
