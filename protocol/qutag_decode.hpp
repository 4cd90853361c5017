#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/record_decoder.hpp"
#include "protocol/recording_header.hpp"

namespace splid {

// qutools' binary file: a header of 40 bytes whose meaning is not published, then for each
// detection 8 bytes with its time in ps and 2 bytes with its channel, little endian, signed. Every
// channel is an input, also that of the syncs: the configuration's channels.sync names it.
//
// The header of such a file, by its first bytes; absent where there are fewer than 40 of them.
// Errors: Error(Fault::data) where there are no more.
std::optional<RecordingHeader> parse_qutag_header(std::span<const std::byte> prefix, bool complete);

// The records of such a file. Each is a photon of its channel; channels outside 0 to 63 are
// counted as unknown and left out.
//
// Threads: one. No allocation.
class QutagDecoder final : public RecordDecoder {
 public:
  [[nodiscard]] std::size_t record_bytes() const override { return 10; }
  Progress decode(std::span<const std::byte> records, std::span<Tag> out) override;
  [[nodiscard]] std::uint64_t unknown_records() const override { return unknown_records_; }
  // The time of the last detection.
  [[nodiscard]] std::int64_t reached_ps() const override { return reached_ps_; }

 private:
  std::int64_t reached_ps_ = 0;
  std::uint64_t unknown_records_ = 0;
};

}  // namespace splid
