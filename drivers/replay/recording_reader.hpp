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
#include "protocol/tag.hpp"

namespace splid {

// Reads a PTU recording from its beginning to its end, however large, in 1 MiB of memory.
//
// A record count of 0 (the recorder was stopped) or one too large reads up to the end of the file.
// What follows the last counted record is left out. Each of these and a cut last record is a
// warning, given once.
//
// Threads: one. Errors: Error(Fault::data) with the file and the byte offset. No allocation after
// construction but for warnings.
class RecordingReader {
 public:
  using Warn = std::function<void(const std::string&)>;

  // Reads the header. warn: never empty.
  RecordingReader(std::string file, Warn warn);
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  [[nodiscard]] const PtuHeader& header() const { return header_; }

  // Writes the next tags; 0 only at the end. `out` is not empty; elements past the tags written
  // hold nothing of use.
  std::size_t read(std::span<Tag> out);

  // So far.
  [[nodiscard]] std::uint64_t records() const { return records_; }
  [[nodiscard]] const PtuDecoder& decoder() const { return *decoder_; }

 private:
  void read_header();
  // For an error: what a file that is no recording seems to be, and what to do with it.
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
  std::optional<PtuDecoder> decoder_;
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0;  // of what is not decoded yet, in buffer_
  std::size_t end_ = 0;
  std::uint64_t file_bytes_ = 0;  // read from the file
  std::uint64_t records_ = 0;
  bool ended_ = false;
};

}  // namespace splid
