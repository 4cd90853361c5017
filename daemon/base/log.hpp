#pragma once

#include <fmt/core.h>

#include <string>
#include <string_view>
#include <utility>

namespace splid {

// The log's lines, at three levels. Where the log goes is for the program to say: to standard error
// or the journal (daemon/commands/app.cpp), or to Python (python/src/shared.cpp).
//
// Design note: this is all that most of the program sees of spdlog. Its own info() and warn() bring
// fmt's formatting into each file that calls one, which took 2 of 4 to 9 s of a compilation.
//
// Threads: any. Errors: none.

// The least level that is written: one of trace, debug, info, warning, error, critical, off.
void set_log_level(const std::string& name);

// As shown_text() has it (protocol/shown_text.hpp): one line of at most 2000 bytes.
void log_info(std::string_view line);
void log_warning(std::string_view line);
void log_error(std::string_view line);

// With the values in the format's places.
template <class... Values>
void log_info(fmt::format_string<Values...> format, Values&&... values) {
  log_info(std::string_view(fmt::format(format, std::forward<Values>(values)...)));
}

template <class... Values>
void log_warning(fmt::format_string<Values...> format, Values&&... values) {
  log_warning(std::string_view(fmt::format(format, std::forward<Values>(values)...)));
}

template <class... Values>
void log_error(fmt::format_string<Values...> format, Values&&... values) {
  log_error(std::string_view(fmt::format(format, std::forward<Values>(values)...)));
}

}  // namespace splid
