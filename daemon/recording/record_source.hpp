#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid::recording {

struct RecordSummary {
  std::uint64_t records = 0;           // in the file, overflow records included
  std::uint64_t lost_tags = 0;         // known count; includes tags that no record can hold
  std::uint64_t uncounted_losses = 0;  // whose count nobody knows
  std::uint64_t bytes = 0;
  double seconds = 0;        // of the tagger's clock, first tag to last
  std::uint64_t strays = 0;  // of the lost tags, those that StrayTimes took out
};

// How much of a stream to record.
struct Limit {
  double seconds = 0;  // of the tagger's clock; 0: to the end of the stream
  // Called a few times a second with the seconds recorded so far.
  std::function<void(double seconds)> progress = [](double) {};
  // Called with all tags, in stream order, once they were given to the recording.
  std::function<void(std::span<const Tag>)> see = [](std::span<const Tag>) {};
};

// Records a source's tags into one PTU file, until the stream ends, the limit is reached or a stop
// is requested; the tags that the ring then holds are written too. The counts of a configured
// encoder go into a file beside the recording. Shows its progress on a terminal.
//
// Threads: the caller's; the source gets a thread of its own. Errors: those of the source, thrown
// after the recording was closed; those of PtuWriter; Error(Fault::device) where a live source
// takes more than limit.seconds and 5 s to send limit.seconds of tags.
RecordSummary record_source(const Config& config, TagSource& source, const std::string& file,
                            bool overwrite, const Clock& clock, const std::stop_token& stop,
                            const Limit& limit = {});

// "3 records (1,234 bytes, 1.5 s) in FILE, 0 tags lost".
std::string in_words(const RecordSummary& summary, const std::string& file);

}  // namespace splid::recording
