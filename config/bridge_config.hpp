#pragma once

#include <string>

#include "drivers/source.hpp"

namespace splid {

// Reads the configuration of a bridge: a JSON file with "schema", "v", "listen", and the keys of
// the instrument's options, which are then valid.
//
// maker: the bridge's name, such as picoquant; the schema is "splid.bridge." with the name.
// Returns where the bridge is to listen: unix:PATH or tcp:HOST:PORT.
//
// Errors: Error(Fault::usage) as load_config().
std::string load_bridge_config(const std::string& file, const std::string& maker,
                               SourceOptions& options);

}  // namespace splid
