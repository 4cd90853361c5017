#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/record_decoder.hpp"
#include "protocol/recording_header.hpp"
#include "protocol/tag.hpp"

namespace splid {

// A recording is read more than once, first for its header. Errors: Error(Fault::data) where `file`
// is a pipe, a socket or a terminal, of which nothing is read.
void require_seekable(const std::string& file);

// Reads a recording of any format that splid knows (protocol/recording_format.hpp) from its
// beginning to its end, however large, in 1 MiB of memory. The tags are as the format's decoder
// gives them.
//
// Where the header's record count is 0 (the recorder was stopped), negative or too large, the file
// is read up to its end. Bytes after the last counted record are left out. Each of these cases, and
// a last record that is cut off, gives one warning.
//
// Threads: one. Errors: as require_seekable(); Error(Fault::data) with the file and the byte
// offset. No allocation after construction but for warnings.
class RecordingReader {
 public:
  using Warn = std::function<void(const std::string&)>;

  // Reads the header. warn: never empty. period_ps: the pattern period, by which the syncs of T3
  // records become times; 0: that which the header has.
  RecordingReader(std::string file, Warn warn, double period_ps = 0);
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  [[nodiscard]] const RecordingHeader& header() const { return header_; }

  // Writes the next tags and returns their number, 0 only at the end. `out` is not empty; its
  // elements past the tags written hold nothing of use.
  std::size_t read(std::span<Tag> out);

  // The records that were read so far.
  [[nodiscard]] std::uint64_t records() const { return records_; }
  // What was seen so far of records that are no tags, and how far the clock has come.
  [[nodiscard]] const RecordDecoder& decoder() const { return *decoder_; }

 private:
  void read_header();
  void put_losses_between_syncs();
  std::optional<RecordingHeader> header_of(std::span<const std::byte> prefix, bool complete);
  [[nodiscard]] std::string settings_beside(RecordingFormat format) const;
  // What a file that is no recording seems to be, and what to do with it, for an error's sentence.
  [[nodiscard]] std::string what_else_it_is() const;
  bool refill();
  std::size_t read_bytes(std::size_t max_bytes);
  void end_of_file();
  void warn_of_rest();
  [[nodiscard]] std::uint64_t end_of_records() const;

  std::string file_;
  Warn warn_;
  int descriptor_ = -1;
  RecordingHeader header_;
  double period_ps_;
  std::unique_ptr<RecordDecoder> decoder_;  // once the header is read
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0;  // begin and end in buffer_ of the bytes that are not decoded yet
  std::size_t end_ = 0;
  std::uint64_t file_bytes_ = 0;  // bytes read from the file
  std::uint64_t records_ = 0;
  bool ended_ = false;
};

}  // namespace splid
