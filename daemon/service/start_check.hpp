#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace splid {

// What would be as wrong at every start with this configuration, told before anything is opened,
// bound or made: files that are missing or of another kind, frames that the ring cannot hold, more
// memory than the machine has, sockets without a folder. `run` begins with it and `check` says it.
//
// Threads: any. Errors: Error(Fault::usage) naming the file, the JSON pointer, the value and what
// to do; Error(Fault::device) for an address that this machine does not have now but may have
// later.
void check_start(const Config& config);

// Sentences about what `run` would begin without, and try again until it is there.
std::vector<std::string> start_notes(const Config& config);

}  // namespace splid
