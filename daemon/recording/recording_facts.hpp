#pragma once

#include <string>

#include "config/config.hpp"
#include "drivers/source.hpp"
#include "protocol/ptu_header.hpp"

namespace splid {

// What the daemon knows of a recording before its first tag: instrument, release, pattern and
// configuration. encoder_file: path of the counts beside it; empty: none.
PtuFacts recording_facts(const Config& config, const SourceInfo& source,
                         const std::string& encoder_file);

}  // namespace splid
