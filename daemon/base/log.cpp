#include "daemon/base/log.hpp"

#include <spdlog/spdlog.h>

namespace splid {

void set_log_level(const std::string& name) { spdlog::set_level(spdlog::level::from_str(name)); }

void log_info(std::string_view line) { spdlog::info(line); }
void log_warning(std::string_view line) { spdlog::warn(line); }
void log_error(std::string_view line) { spdlog::error(line); }

}  // namespace splid
