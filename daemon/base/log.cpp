#include "daemon/base/log.hpp"

#include <spdlog/spdlog.h>

#include "protocol/shown_text.hpp"

namespace splid {

void set_log_level(const std::string& name) { spdlog::set_level(spdlog::level::from_str(name)); }

void log_info(std::string_view line) { spdlog::info(shown_text(line, most_said)); }
void log_warning(std::string_view line) { spdlog::warn(shown_text(line, most_said)); }
void log_error(std::string_view line) { spdlog::error(shown_text(line, most_said)); }

}  // namespace splid
