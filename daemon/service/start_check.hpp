#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace splid {

// Finds what would go wrong at every start with this configuration, before anything is opened,
// bound or made: files that are missing or of another kind, frames that the ring cannot hold, what
// the estimator refuses, more inputs than a recording holds, more memory than the machine has,
// sockets without a folder. `run` begins with this check, and `check` reports it.
//
// Threads: any. Errors: Error(Fault::usage) naming the file, the JSON pointer, the value and what
// to do; Error(Fault::device) for an address that this machine does not have now but may have
// later.
void check_start(const Config& config);

// Returns a sentence on each thing that `run` would begin without and look for again until it is
// there.
std::vector<std::string> start_notes(const Config& config);

}  // namespace splid
