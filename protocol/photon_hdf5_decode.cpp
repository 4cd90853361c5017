#include "protocol/photon_hdf5_decode.hpp"

#include <cstring>

namespace splid {

PhotonHdf5Decoder::PhotonHdf5Decoder(double unit_ps, std::optional<double> step_s)
    : clock_(unit_ps), has_syncs_(step_s.has_value()) {
  if (step_s) step_ps_ = step_of_time_ps(*step_s);
}

// Unsigned, since the timestamps of a damaged file may be anything.
std::int64_t PhotonHdf5Decoder::time_ps(std::int64_t timestamp) const {
  const auto number = static_cast<std::uint64_t>(timestamp);
  if (timestamp >= 0) return clock_.time_ps(number);
  return static_cast<std::int64_t>(0 - static_cast<std::uint64_t>(clock_.time_ps(0 - number)));
}

std::size_t PhotonHdf5Decoder::put(const PhotonHdf5Record& record, std::span<Tag> out) {
  timestamp_ = record.timestamp;
  std::int64_t at_ps = time_ps(timestamp_);
  std::size_t written = 0;
  if (has_syncs_) {
    if (told_ != timestamp_) write_tag(out[written++], at_ps, {0, TagKind::sync, {}});
    told_ = timestamp_;
    const double since_ps = static_cast<double>(record.nanotime) * step_ps_;
    at_ps = static_cast<std::int64_t>(static_cast<std::uint64_t>(at_ps) +
                                      static_cast<std::uint64_t>(CountedSyncs::rounded(since_ps)));
  }
  Tag& photon = written < out.size() ? out[written++] : waiting_.emplace();
  write_tag(photon, at_ps, {record.detector, TagKind::photon, {}});
  return written;
}

RecordDecoder::Progress PhotonHdf5Decoder::decode(std::span<const std::byte> records,
                                                  std::span<Tag> out) {
  Progress progress;
  if (waiting_ && !out.empty()) {
    out[progress.tags++] = *waiting_;
    waiting_.reset();
  }
  while (progress.tags < out.size() && records.size() - progress.bytes >= record_bytes()) {
    PhotonHdf5Record record;
    std::memcpy(&record, records.data() + progress.bytes, sizeof record);
    progress.bytes += sizeof record;
    const bool is_known = record.detector >= 0 && record.detector <= most_photon_hdf5_detector;
    if (is_known) {
      progress.tags += put(record, out.subspan(progress.tags));
    } else {
      ++unknown_records_;
    }
  }
  return progress;
}

}  // namespace splid
