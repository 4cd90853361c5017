#pragma once

#include <cstdint>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/clock.hpp"
#include "drivers/source.hpp"

namespace splid {

struct CaptureSummary {
  std::uint64_t records = 0;    // of the file, overflows included
  std::uint64_t lost_tags = 0;  // known count, those that no record can hold included
  std::uint64_t bytes = 0;
  double seconds = 0;  // of the tagger's clock, first tag to last
};

// From a source straight into a PTU recording, until the stream ends or a stop is requested; what
// the ring then holds is written too. The counts of an encoder, where there is one, go beside it.
// Shows its progress on a terminal.
//
// Threads: made and run on one; the source gets its own. Errors: those of the source, after the
// recording was closed, and of the recorder.
CaptureSummary capture(const Config& config, TagSource& source, const std::string& file,
                       bool overwrite, const Clock& clock, const std::stop_token& stop);

// "3 records (1,234 bytes, 1.5 s) in FILE, 0 tags lost".
std::string describe(const CaptureSummary& summary, const std::string& file);

}  // namespace splid
