#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <thread>

#include "config/config.hpp"
#include "daemon/recording/frame_log.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid {

// The frames of tags that are being recorded, as a table beside the recording: `splid record` with
// record.frames. Each tag is copied into a ring of its own, from which a stream makes frames, so
// that neither estimation nor the table's disk delays the recording. Of a live source the tags for
// which that ring has no room become a loss in the frames, never in the recording. Frames have no
// reference, since the encoder's counts go into the recording's own file.
//
// Threads: take() and finish() one; the copy has those of a Stream, and one that takes its frames.
// Errors: the constructor throws as Stream does; finish() throws what ended the stream.
class MeasuredCopy {
 public:
  // config: outlives this. source: of the tags.
  MeasuredCopy(const Config& config, const SourceInfo& source, const std::string& recording);
  ~MeasuredCopy();
  MeasuredCopy(const MeasuredCopy&) = delete;
  MeasuredCopy& operator=(const MeasuredCopy&) = delete;

  void take(std::span<const Tag> tags);
  // The recording is whole: waits for all frames, and for its checksum unless a stop is requested.
  // Returns in a sentence how many frames are kept.
  std::string finish(const std::stop_token& stop);

 private:
  void close();
  void publish(const Config& config);

  std::string recording_;
  std::string table_;
  bool waits_;
  bool closed_ = false;
  TagRing ring_;
  DroppingSink dropping_;
  Stream stream_;
  recording::FrameLog frames_;
  std::exception_ptr fault_;  // of thread_, until it has ended
  std::stop_source over_;     // nobody takes tags out of the ring any more
  std::jthread thread_;
};

}  // namespace splid
