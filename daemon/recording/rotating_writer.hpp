#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "config/daemon_options.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/recording/encoder_log.hpp"
#include "daemon/recording/ptu_writer.hpp"
#include "daemon/recording/recording_folder.hpp"
#include "daemon/recording/stray_times.hpp"
#include "daemon/stream/channel_map.hpp"
#include "daemon/stream/device_clock.hpp"
#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid::recording {

// What a RotatingWriter writes into each of its files.
struct Plan {
  RecordOptions options;
  ChannelOptions channels;
  SourceInfo source;  // of the tags
  PtuFacts facts;     // for each header; the writer adds the name of the file of encoder counts
};

// Writes a stream of tags into recordings, one file after the other, each readable by itself. A new
// file begins when the current file has reached RecordOptions' size or length, and when the
// tagger's clock was set anew. The last tag of a file and the first tag of the next file are
// neighbours in the stream. A loss that is open at the end of a file is open at the beginning of
// the next file. A single tag far ahead of all others is not written but counted: see StrayTimes.
//
// When a file cannot be made or written, or was removed meanwhile, the writer tries again every 5
// s, but only once the disk has 4 MiB of room. The tags that come meanwhile are lost and counted,
// and a `missed` tag before the first tag of the next file carries their count. So each tag taken
// is in a file or among a file's losses, except the tags lost after the last file.
//
// Threads: one. Errors: none; see fault().
class RotatingWriter {
 public:
  // Opens the encoder counts that go beside a recording; called once for each file. Null: there is
  // no encoder.
  using OpenCounts = std::function<std::unique_ptr<EncoderSource>()>;

  // clock: outlives this. say: takes a sentence for people, never an empty one.
  RotatingWriter(Plan plan, const Clock& clock, OpenCounts open_counts,
                 std::function<void(const std::string&)> say);

  // tags: at most 65,536, in stream order.
  void take(std::span<const Tag> tags);
  // Hands the tags taken so far to the operating system. To be called at least twice a second.
  void flush();
  // The stream is over: ends the current file.
  void close();

  // Why nothing is recorded at present, in a sentence; empty while all is well.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] std::uint64_t files() const { return files_; }     // begun so far
  [[nodiscard]] const std::string& file() const { return file_; }  // the last file; empty: none yet
  // Of the last file: its size once everything pending is written, and the time from its first tag
  // to its last.
  [[nodiscard]] std::uint64_t file_bytes() const { return file_bytes_; }
  [[nodiscard]] double file_seconds() const;
  // Tags lost because the disk was full or failed, or because their file was removed.
  [[nodiscard]] std::uint64_t lost_tags() const { return lost_tags_; }
  // Tags of the files that have ended that no record could hold; among the losses of these files.
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }
  // Single tags far ahead of all others; among the losses of the files.
  [[nodiscard]] std::uint64_t strays() const { return stray_times_.strays(); }

 private:
  // The tags lost since the end of the last file.
  struct Gap {
    std::uint64_t count = 0;
    bool unknown = false;  // more tags than `count` are lost, nobody knows how many
  };

  void record(std::span<const Tag> tags);
  [[nodiscard]] std::size_t until_cut(std::span<const Tag> tags) const;
  [[nodiscard]] std::int64_t end_of_file(std::int64_t first_ps) const;
  void follow_losses(std::span<const Tag> tags);
  void store(std::span<const Tag> tags);
  [[nodiscard]] bool begin_file(std::int64_t first_ps);
  void open_file(std::int64_t first_ps);
  void write_gap(std::int64_t first_ps);
  void end_file();
  void fail(const std::string& why);
  void remove_file();
  void lose(std::span<const Tag> tags);
  void lose(std::uint64_t count);

  Plan plan_;
  const Clock& clock_;
  OpenCounts open_counts_;
  std::function<void(const std::string&)> say_;
  Folder folder_;
  ChannelMap channels_;
  StrayTimes stray_times_;

  std::string file_;
  std::optional<PtuWriter> writer_;  // absent while no file is being written
  std::optional<EncoderLog> counts_;
  std::uint64_t file_bytes_ = 0;
  std::int64_t first_ps_ = 0, last_ps_ = 0;  // of the last file's tags
  std::int64_t end_ps_ = 0;                  // tags from this time on go to the next file
  bool loss_is_open_ = false;
  Gap gap_;
  std::int64_t retry_ns_ = 0;  // while fault_ is not empty, no new file before this time
  std::string fault_;
  std::uint64_t files_ = 0;
  std::uint64_t lost_tags_ = 0;
  std::uint64_t rejected_ = 0;
};

}  // namespace splid::recording
