#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "drivers/source.hpp"

namespace splid {

struct RecordSummary {
  std::uint64_t records = 0;    // of the file, overflows included
  std::uint64_t lost_tags = 0;  // known count, those that no record can hold included
  std::uint64_t bytes = 0;
  double seconds = 0;  // of the tagger's clock, first tag to last
};

// For how much of a stream.
struct RecordLimit {
  double seconds = 0;  // of the tagger's clock; 0: to its end
  // Hears a few times a second how many there are.
  std::function<void(double seconds)> progress = [](double) {};
};

// From a source straight into a PTU recording, until the stream ends or a stop is requested; what
// the ring then holds is written too. The counts of an encoder, where there is one, go beside it.
// Shows its progress on a terminal.
//
// Threads: made and run on one; the source gets its own. Errors: those of the source, after the
// recording was closed, and of the recorder; Error(Fault::device)
// where a live source sends less than limit.seconds in that time and 5 s more.
RecordSummary record_source(const Config& config, TagSource& source, const std::string& file,
                            bool overwrite, const Clock& clock, const std::stop_token& stop,
                            const RecordLimit& limit = {});

// "3 records (1,234 bytes, 1.5 s) in FILE, 0 tags lost".
std::string in_words(const RecordSummary& summary, const std::string& file);

}  // namespace splid
