#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/recording/frame_log.hpp"
#include "daemon/recording/rotating_writer.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/tag_tap.hpp"
#include "drivers/source.hpp"
#include "protocol/encoder_batch.hpp"
#include "protocol/status_json.hpp"
#include "protocol/tag.hpp"

namespace splid::recording {

// The room daemon/recording keeps tags on the disk: while the daemon measures as one file after the
// other, by the recording::Tap in this header and by RotatingWriter; for `splid record` as a single
// file, by record_source(). Both write each file with PtuWriter. Read this header first.

// Encoder batches on their way from the thread that publishes to the thread that records.
//
// Threads: any; locks. Errors: none.
class CountsQueue {
 public:
  // When 65,536 batches or 4,194,304 counts wait, a new batch is dropped, and the next batch taken
  // says overrun.
  void put(const EncoderBatch& batch);
  // Takes the oldest batch. False where no batch waits.
  bool take(EncoderBatch& batch);

 private:
  std::mutex mutex_;
  // All four guarded by mutex_.
  std::vector<EncoderBatch> batches_;  // those from index first_ on still wait
  std::size_t first_ = 0;
  std::size_t counts_ = 0;  // in batches_, since there were none
  bool overrun_ = false;
};

// Records the tags that the daemon measures from. The framer's thread copies its tags into a ring;
// the tap's own thread, `recorder`, takes them from the ring into files. With a live source the
// framer never waits for the recorder: when the ring is full, the newest tags are dropped and
// become a loss in the recording. With a source that can wait, such as a replay, the framer waits,
// so that the recording is whole.
//
// Tags reach the operating system within half a second, so that a killed daemon loses no more than
// that. They are not forced onto the disk: a machine that loses power loses what the system had not
// written yet.
//
// Threads: take() and finish() the framer's; take_counts() and take_frame() the publisher's;
// hurry(), fault(), file() and status() any; summary() once finish() was called. Errors: none;
// faults of the disk are in fault(). take() allocates nothing and takes no lock.
class Tap final : public TagTap {
 public:
  // clock: outlives this. say: takes a sentence about what is lost and why, on the recorder's
  // thread and on the thread of its FrameLog.
  Tap(const Config& config, const SourceInfo& source, const Clock& clock,
      std::function<void(const std::string&)> say);
  ~Tap() override;
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;

  void take(std::span<const Tag> tags) override;
  void finish() override;
  // A stop was requested: take() no longer waits. From the first tag on that finds no room, all are
  // lost, and counted.
  void hurry() { hurried_.request_stop(); }

  // Says that there is an encoder, whose counts go into a file beside each recording. To be called
  // before the first tag.
  void expect_counts() { has_counts_ = true; }
  void take_counts(const EncoderBatch& batch) { counts_.put(batch); }
  // A frame was published: where the configuration asks for tables, it goes into the table beside
  // the recording that is being written now. Never waits for the disk.
  void take_frame(const FrameMessage& frame);

  // Why nothing is recorded at present, in a sentence; empty while all is well.
  [[nodiscard]] std::string fault() const;
  // The file begun last; empty: no file yet.
  [[nodiscard]] std::string file() const;
  // For the `status` message.
  [[nodiscard]] RecordingStatus status() const;
  // Waits until every tag is written; says in a sentence how many recordings there are and what is
  // lost.
  [[nodiscard]] std::string summary();
  // The disk does not take the rest, and no report goes out any more. Returns a sentence about what
  // is lost.
  [[nodiscard]] std::string give_up();

 private:
  void lose(std::span<const Tag> tags);
  void tell(const std::string& sentence);
  void run();
  void look_around();
  void put_frames();
  [[nodiscard]] std::unique_ptr<EncoderSource> open_counts();

  const Clock& clock_;
  std::mutex say_mutex_;
  std::function<void(const std::string&)> say_;  // guarded by say_mutex_
  bool waits_;                                   // take() waits for room, since the source can wait
  bool has_counts_ = false;
  CountsQueue counts_;
  TagRing ring_;
  DroppingSink dropping_;
  bool finished_ = false;  // the framer's thread only
  std::stop_source hurried_;
  std::atomic<std::uint64_t> not_awaited_{0};  // events lost since take() did not wait
  std::atomic<std::uint64_t> unflushed_{0};    // tags out of the ring, since the last flush
  // The recorder's thread only, until it has ended.
  std::vector<std::string> news_;  // sentences not yet said
  RotatingWriter writer_;
  std::int64_t flushed_ns_ = 0;
  std::uint64_t said_drops_ = 0;
  mutable std::mutex mutex_;
  std::string fault_;       // guarded by mutex_
  RecordingStatus status_;  // guarded by mutex_
  RecordFrames tables_;
  std::unique_ptr<FrameLog> frames_;  // null: frames are not kept
  std::vector<FrameMessage> early_;   // the publisher's thread; wait for the first recording
  std::jthread thread_;
};

struct Ended {
  bool whole = true;  // the disk took everything in time
  std::string text;   // how many recordings there are, and what is lost
  std::string file;   // the file begun last; empty: none
};

// Ends a recording that nobody gives tags any more. Where the disk does not take the rest within
// the patience, what is left counts as lost; it goes on in a thread of its own, which a frozen disk
// may hold for ever.
Ended end_within(std::unique_ptr<Tap> tap, std::chrono::milliseconds patience);

}  // namespace splid::recording
