#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/recording/rotating_writer.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/tag_tap.hpp"
#include "drivers/encoder/encoder_batch.hpp"
#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Encoder batches on their way from the thread that publishes to the one that records.
//
// Threads: any; locks. Errors: none.
class CountsQueue {
 public:
  // Past 65,536 batches the newest are dropped, and the next one says overrun.
  void put(const EncoderBatch& batch);
  // False where there is none.
  bool take(EncoderBatch& batch);

 private:
  std::mutex mutex_;
  std::vector<EncoderBatch> batches_;  // under the mutex, from first_ on
  std::size_t first_ = 0;              // likewise
  bool overrun_ = false;               // likewise
};

// Keeps what is measured from, on a thread of its own: the framer's thread copies its tags into a
// ring, `recorder` takes them from there into files. Of a live source the framer never waits: when
// the ring is full the newest tags are dropped, and a loss in the recording. Of another it does, so
// that the recording of a replay is whole.
//
// What comes is in the hands of the system within half a second, so that a killed daemon loses no
// more. It is not forced onto the disk: a machine that loses power loses what the system had not
// written yet.
//
// Threads: take() and finish() the framer's; take_counts() the publisher's; fault() and file() any;
// summary() once finish() was called. Errors: none; the disk's are in fault(). take() allocates
// nothing and takes no lock.
class RecordingTap final : public TagTap {
 public:
  // config, clock: outlive this. say: hears, on the recorder's thread, of what is lost and why.
  RecordingTap(const Config& config, const SourceInfo& source, const Clock& clock,
               std::function<void(const std::string&)> say);
  ~RecordingTap() override;
  RecordingTap(const RecordingTap&) = delete;
  RecordingTap& operator=(const RecordingTap&) = delete;

  void take(std::span<const Tag> tags) override;
  void finish() override;

  // There is an encoder, whose counts go beside the files. Before the first tag.
  void expect_counts() { has_counts_ = true; }
  void take_counts(const EncoderBatch& batch) { counts_.put(batch); }

  // Why nothing is recorded, in a sentence; empty while all is well.
  [[nodiscard]] std::string fault() const;
  // The last file begun; empty: none yet.
  [[nodiscard]] std::string file() const;
  // Waits until all is written.
  [[nodiscard]] std::string summary();

 private:
  void run();
  void look_around();
  [[nodiscard]] std::unique_ptr<EncoderSource> open_counts();

  const Clock& clock_;
  std::function<void(const std::string&)> say_;
  bool waits_;  // the source can
  bool has_counts_ = false;
  CountsQueue counts_;
  TagRing ring_;
  DroppingSink dropping_;
  bool finished_ = false;          // framer only
  std::vector<std::string> news_;  // recorder only: sentences not yet said
  RotatingWriter recorder_;        // likewise, until it ended
  std::int64_t flushed_ns_ = 0;    // likewise
  std::uint64_t said_drops_ = 0;   // likewise
  mutable std::mutex mutex_;
  std::string fault_;  // under the mutex
  std::string file_;   // likewise
  std::jthread thread_;
};

}  // namespace splid
