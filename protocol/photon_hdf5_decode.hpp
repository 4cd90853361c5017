#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/counted_syncs.hpp"
#include "protocol/record_decoder.hpp"
#include "protocol/tag.hpp"

namespace splid {

// A photon of a Photon-HDF5 file, whose arrays have its timestamp, detector and nanotime in three
// places, as one record.
struct PhotonHdf5Record {
  std::int64_t timestamp = 0;  // in units of the file's
  std::uint32_t nanotime = 0;  // in steps of the file's; 0 where it has none
  std::int32_t detector = 0;   // -1: none that a recording could have
};
static_assert(sizeof(PhotonHdf5Record) == 16);

// The largest detector that is read: a PTU, which these files are made into, has no larger input.
inline constexpr std::int64_t most_photon_hdf5_detector = 62;

// Turns such records into tags.
//
//  - Without nanotimes a timestamp is a photon's time, and a detector its input (T2).
//  - With nanotimes a timestamp is the number of the last sync before the photon, and the nanotime
//    the time since that sync, as in PicoQuant's T3 mode (PtuT3Decoder): a sync tag comes before
//    the first photon of its period, and the times are in the generator's own clock.
//  - A photon of a detector above 62 is counted as unknown and left out.
//
// Threads: one. No allocation.
class PhotonHdf5Decoder final : public RecordDecoder {
 public:
  // unit_ps: of a timestamp, 1 ps to 1 s; with nanotimes, the pattern period. step_s: of a
  // nanotime, 1e-15 to 1e-3; absent where there are none. Errors: Error(Fault::data) for values
  // outside.
  PhotonHdf5Decoder(double unit_ps, std::optional<double> step_s);

  [[nodiscard]] std::size_t record_bytes() const override { return sizeof(PhotonHdf5Record); }
  Progress decode(std::span<const std::byte> records, std::span<Tag> out) override;
  [[nodiscard]] std::uint64_t unknown_records() const override { return unknown_records_; }
  [[nodiscard]] std::int64_t reached_ps() const override { return time_ps(timestamp_); }

 private:
  [[nodiscard]] std::int64_t time_ps(std::int64_t timestamp) const;
  std::size_t put(const PhotonHdf5Record& record, std::span<Tag> out);

  CountedSyncs clock_;
  bool has_syncs_;
  double step_ps_ = 0;
  std::int64_t timestamp_ = 0;        // the last
  std::optional<std::int64_t> told_;  // timestamp whose sync was the last to become a tag
  std::optional<Tag> waiting_;        // a photon for which there was no room
  std::uint64_t unknown_records_ = 0;
};

}  // namespace splid
