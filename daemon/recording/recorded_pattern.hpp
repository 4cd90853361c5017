#pragma once

#include <string>

#include "config/config.hpp"
#include "protocol/ptu_header.hpp"

namespace splid {

// A sentence where a recording carries the pattern that was played for it, and the configuration
// has another one (fewer than 70 % of its pulses lie on the other's, turned as suits best); empty
// where they agree, and where the recording carries none.
//
// header: of the recording `file`. Threads: any. Errors: none; a pattern that cannot be read is
// said too.
std::string other_pattern_than_recorded(const Config& config, const PtuHeader& header,
                                        const std::string& file);

// Writes that sentence to the log. Errors: as scan_recording().
void warn_of_other_pattern(const Config& config, const std::string& file);

}  // namespace splid
