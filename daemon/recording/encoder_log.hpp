#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <span>
#include <string>

#include "daemon/stream/channel_map.hpp"
#include "drivers/encoder/encoder_source.hpp"
#include "protocol/tag.hpp"

namespace splid::recording {

// Writes the encoder's counts, unchanged, into a file beside a recording.
//
// Threads: one. Errors: Error(Fault::device) where the file cannot be written; those of the
// encoder.
class EncoderLog {
 public:
  // source: not null.
  EncoderLog(const std::string& recording, std::unique_ptr<EncoderSource> source,
             const ChannelMap& channels);

  // Writes the counts that a live encoder has sent by now. From an encoder that is a file, writes
  // as many counts as there are encoder markers among `tags`, the next tags of the recording.
  void write(std::span<const Tag> tags);
  // Hands the counts to the operating system, so that they survive a killed process.
  void flush();

 private:
  std::string file_;
  std::ofstream out_;
  std::unique_ptr<EncoderSource> source_;
  ChannelMap channels_;
  EncoderBatch batch_;
  std::int64_t markers_ = 0;  // encoder markers in the recording so far
  std::int64_t counts_ = 0;   // counts written so far
};

}  // namespace splid::recording
