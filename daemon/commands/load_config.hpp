#pragma once

#include <string>

#include "config/config.hpp"

namespace splid {

// load_config(), and says in the log what of it people should know: where the pattern was found.
Config load_config_aloud(const std::string& file);

}  // namespace splid
