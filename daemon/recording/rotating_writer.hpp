#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/recording/encoder_log.hpp"
#include "daemon/recording/ptu_writer.hpp"
#include "daemon/recording/recording_folder.hpp"
#include "daemon/stream/channel_map.hpp"
#include "daemon/stream/device_clock.hpp"
#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid {

// A stream of tags into one recording after the other, each readable by itself: a new one when the
// one before is as large or as long as config.record says, or the tagger's clock was set anew. The
// last tag of one and the first of the next are neighbours in the stream; a loss that is open there
// goes on in the next.
//
// When a file cannot be made or written, it is tried again every 5 s, and once the disk has 4 MiB.
// What came meanwhile is lost and counted, and `missed` before the first tag of the next file: each
// tag taken is in a file or in a file's losses, but those lost since the last file.
//
// Threads: one. Errors: none; see fault().
class RotatingWriter {
 public:
  // Gives the counts that go beside a recording; each file asks for one. Null: there are none.
  using OpenCounts = std::function<std::unique_ptr<EncoderSource>()>;

  // config, clock: outlive this. say: a sentence for people; never empty.
  RotatingWriter(const Config& config, SourceInfo source, const Clock& clock,
                 OpenCounts open_counts, std::function<void(const std::string&)> say);

  // At most 65,536, in stream order.
  void take(std::span<const Tag> tags);
  // Hands what came to the system. To be called at least twice a second.
  void flush();
  // The end of the stream, as far as it came.
  void close();

  // Why nothing is recorded, in a sentence; empty while all is well.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] std::uint64_t files() const { return files_; }     // begun
  [[nodiscard]] const std::string& file() const { return file_; }  // the last of them; empty: none
  // Tags that a full or failing disk lost.
  [[nodiscard]] std::uint64_t lost_tags() const { return lost_tags_; }

 private:
  // What is lost since the last file.
  struct Gap {
    std::uint64_t count = 0;
    bool unknown = false;  // and more than that
  };

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

  const Config& config_;
  SourceInfo source_;
  const Clock& clock_;
  OpenCounts open_counts_;
  std::function<void(const std::string&)> say_;
  RecordingFolder folder_;
  ChannelMap channels_;

  std::string file_;
  std::optional<PtuWriter> recorder_;  // absent: no file is being written
  std::optional<EncoderLog> counts_;
  std::int64_t end_ps_ = 0;  // a tag from there on goes to the next file
  bool loss_is_open_ = false;
  Gap gap_;
  std::int64_t retry_ns_ = 0;  // not sooner, where fault_ says something
  std::string fault_;
  std::uint64_t files_ = 0;
  std::uint64_t lost_tags_ = 0;
};

}  // namespace splid
