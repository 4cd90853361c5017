#include "daemon/commands/load_config.hpp"

#include <spdlog/spdlog.h>

namespace splid {

Config load_config_aloud(const std::string& file) {
  Config config = load_config(file);
  if (!config.pattern_note.empty()) spdlog::warn("{}", config.pattern_note);
  return config;
}

}  // namespace splid
