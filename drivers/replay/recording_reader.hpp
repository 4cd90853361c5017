#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_header.hpp"
#include "protocol/ptu_t3_decode.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Reads a PTU recording from its beginning to its end, however large, in 1 MiB of memory. The tags
// of one in T2 mode are as PtuDecoder gives them, those of one in T3 mode as PtuT3Decoder does.
//
// Where the header's record count is 0 (the recorder was stopped) or too large, the file is read up
// to its end. Bytes after the last counted record are left out. Each of these cases, and a last
// record that is cut off, gives one warning.
//
// Threads: one. Errors: Error(Fault::data) with the file and the byte offset. No allocation after
// construction but for warnings.
class RecordingReader {
 public:
  using Warn = std::function<void(const std::string&)>;

  // Reads the header. warn: never empty. period_ps: the pattern period, by which the syncs of T3
  // records become times; 0: that which the header has.
  RecordingReader(std::string file, Warn warn, double period_ps = 0);
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  [[nodiscard]] const PtuHeader& header() const { return header_; }

  // Writes the next tags and returns their number, 0 only at the end. `out` is not empty; its
  // elements past the tags written hold nothing of use.
  std::size_t read(std::span<Tag> out);

  // The records that were read so far.
  [[nodiscard]] std::uint64_t records() const { return records_; }
  [[nodiscard]] std::uint64_t overflow_records() const;
  [[nodiscard]] std::uint64_t unknown_records() const;
  // Photons of T3 records whose time since their sync was the largest that a record can hold.
  [[nodiscard]] std::uint64_t saturated_photons() const;
  // A time that the records have reached; no later tag is earlier by more than the streams'
  // disorder.
  [[nodiscard]] std::int64_t reached_ps() const;

 private:
  void read_header();
  void make_decoder();
  PtuDecoder::Progress decode(std::span<const std::byte> records, std::span<Tag> out);
  // What a file that is no recording seems to be, and what to do with it, for an error's sentence.
  [[nodiscard]] std::optional<std::string> what_else_it_is() const;
  bool refill();
  std::size_t read_bytes(std::size_t max_bytes);
  void end_of_file();
  void warn_of_rest();
  [[nodiscard]] std::uint64_t end_of_records() const;

  std::string file_;
  Warn warn_;
  int descriptor_ = -1;
  PtuHeader header_;
  double period_ps_;
  std::optional<PtuDecoder> t2_;  // one of the two, once the header is read
  std::optional<PtuT3Decoder> t3_;
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0;  // begin and end in buffer_ of the bytes that are not decoded yet
  std::size_t end_ = 0;
  std::uint64_t file_bytes_ = 0;  // bytes read from the file
  std::uint64_t records_ = 0;
  bool ended_ = false;
};

}  // namespace splid
