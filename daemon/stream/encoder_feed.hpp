#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daemon/base/clock.hpp"
#include "daemon/stream/encoder_join.hpp"
#include "daemon/stream/frame.hpp"
#include "drivers/encoder/encoder_source.hpp"
#include "protocol/frame_json.hpp"

namespace splid {

// Finds each frame's reference from the encoder's counts.
//
// Threads: the thread that publishes. Errors: none; an error of the source of counts goes to the
// log, and no frame has a reference from then on.
class EncoderFeed {
 public:
  // source: not null; clock: outlives this.
  EncoderFeed(std::unique_ptr<EncoderSource> source, const EncoderOptions& options,
              const Clock& clock);

  // Hears each batch of counts as it is taken.
  void observe(std::function<void(const EncoderBatch&)> observer) {
    observer_ = std::move(observer);
  }

  // The reference of the next frame; frames come in their order. Waits for the counts of a live
  // source up to 40 ms after the frame's last tag came, and for four fifths of the frame's length
  // at most, so that a frame is published before the next frame is full. Does not wait where no
  // count came for a second.
  std::optional<FrameMessage::Reference> reference(const Frame& frame);

 private:
  void take_counts();
  void say_fault();

  std::unique_ptr<EncoderSource> source_;
  const Clock& clock_;
  EncoderJoin join_;
  EncoderBatch batch_;
  std::function<void(const EncoderBatch&)> observer_ = [](const EncoderBatch&) {};
  std::int64_t heard_ns_ = 0;  // last batch
  std::string said_;           // fault that the log has
  bool failed_ = false;        // the source threw
};

}  // namespace splid
