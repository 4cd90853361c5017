#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "daemon/recording/frame_table.hpp"
#include "daemon/recording/recording_checksums.hpp"
#include "daemon/recording/table_head.hpp"
#include "protocol/frame_json.hpp"

namespace splid::recording {

// Keeps frames in tables while they are published. The thread that publishes puts each frame into a
// queue, and a thread of the log's own, `frames`, writes the tables, twice a second. With a source
// that can wait, such as a replay, put() waits for room in the queue, so that the table is whole.
// With a live source it never waits: what does not fit into the queue of 4,096 frames, and what a
// full disk does not take, is counted, said and left out.
//
// Threads: put() one thread; finish() the same, or another once nothing is put any more; fault()
// any. Errors: see each call.
class FrameLog {
 public:
  // say: takes a sentence, on the log's thread, about frames that are lost and why, or once they
  // are written again.
  using Say = std::function<void(const std::string&)>;

  // One table, of a replay, which exists when the constructor returns. The checksum of
  // facts.recording is computed meanwhile. Errors: those of FrameTable.
  FrameLog(const std::string& file, const TableFacts& facts, bool overwrite, Say say);
  // The tables of a live source, each of which is made with its first frame; facts.recording is
  // filled in. A table gets its recording's checksum once frames of the next recording come, since
  // its own is over then.
  FrameLog(TableFacts facts, Say say);
  ~FrameLog();
  FrameLog(const FrameLog&) = delete;
  FrameLog& operator=(const FrameLog&) = delete;

  // The next frame. Of a live source: `recording` is the file that its tags went into, and `file`
  // its table; where that is another than before, the table before ends. Errors: none.
  void put(const FrameMessage& frame, const std::string& file = {},
           const std::string& recording = {});
  // Waits until all frames are written, and for the checksums unless a stop is requested or
  // `patience` is over. All recordings are whole by now. Errors: none.
  void finish(const std::stop_token& stop, std::optional<std::chrono::milliseconds> patience = {});

  // Why frames are not written at present, in a sentence; empty while all is well.
  [[nodiscard]] std::string fault() const;
  // "1,234 frames in FILE" or "1,234 frames in 3 tables", and how many are lost where any are.
  // After finish().
  [[nodiscard]] std::string summary() const;

 private:
  struct Entry {
    FrameMessage frame;
    std::string file;
    std::string recording;
  };

  void run();
  void take(const Entry& entry);
  void open(const Entry& entry);
  void flush();
  void say_what_was_dropped();
  void lose(std::uint64_t frames, const std::string& why);
  void finish_table();
  void end_table();

  TableFacts facts_;
  Say say_;
  bool waits_;
  // The log's thread only, until it has ended.
  std::unique_ptr<FrameTable> table_;
  bool may_make_ = true;  // false after a table could not be made, up to the next flush()
  std::uint64_t tables_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t lost_ = 0;
  std::string last_file_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> queue_;             // guarded by mutex_
  std::uint64_t dropped_ = 0;           // guarded by mutex_; found no room in the queue
  bool ended_ = false;                  // guarded by mutex_
  std::string fault_;                   // guarded by mutex_
  std::optional<Checksums> checksums_;  // of a live source
  std::string checksum_;                // of a replay; of the checksum's thread, until it has ended
  std::jthread checksum_thread_;
  std::jthread thread_;
};

}  // namespace splid::recording
