#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <span>
#include <string>

#include "daemon/stream/channel_map.hpp"
#include "drivers/encoder/encoder_source.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Where the counts of a recording are kept.
inline std::string encoder_file_of(const std::string& recording) {
  return recording + ".encoder.csv";
}

// Keeps the encoder's counts beside a recording, as they came.
//
// Threads: one. Errors: Error(Fault::device) where the file cannot be written; those of the source.
class EncoderLog {
 public:
  // source: not null.
  EncoderLog(const std::string& recording, std::unique_ptr<EncoderSource> source,
             const ChannelMap& channels);

  // Counts that came, or that go with these tags of the recording.
  void write(std::span<const Tag> tags);
  // Hands what was written to the system, so that a killed recorder keeps it.
  void flush();

 private:
  std::string file_;
  std::ofstream out_;
  std::unique_ptr<EncoderSource> source_;
  ChannelMap channels_;
  EncoderBatch batch_;
  std::int64_t markers_ = 0;  // in the recording
  std::int64_t counts_ = 0;   // written
};

}  // namespace splid
