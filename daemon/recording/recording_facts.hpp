#pragma once

#include <string>

#include "config/config.hpp"
#include "daemon/recording/table_head.hpp"
#include "drivers/source.hpp"
#include "protocol/ptu_header.hpp"

namespace splid::recording {

// The facts that splid writes into a recording's header before the first tag, and the comparison of
// those facts with a configuration when the recording is read again.

// The instrument, the release, the pattern and the configuration. encoder_file: path of the file
// of encoder counts beside the recording; empty: there is none. Errors: Error(Fault::usage) where
// the configuration names more inputs than a recording can hold.
PtuFacts header_facts(const Config& config, const SourceInfo& source,
                      const std::string& encoder_file);

// Errors: as header_facts().
void check_inputs(const Config& config);

// The facts beside a table of frames. recording: the recording's path; empty: not known yet.
TableFacts table_facts(const Config& config, const std::string& recording);

// Compares the pattern in a recording's header with the configured pattern. Returns a sentence for
// people where fewer than 70 % of the pulses of one pattern lie on pulses of the other, at the
// rotation that suits best, and where the header's pattern cannot be read; an empty text where the
// patterns agree or the header has none.
//
// header: of the recording `file`. Threads: any. Errors: none.
std::string other_pattern_than_recorded(const Config& config, const RecordingHeader& header,
                                        const std::string& file);

// Writes that sentence to the log. Errors: as scan_recording().
void warn_of_other_pattern(const Config& config, const std::string& file);

// Errors: Error(Fault::usage) where a gaussian pulse of the configured width cannot be in the
// recording; see width_fault().
void check_width(const Config& config, const RecordingHeader& header);

}  // namespace splid::recording
