#pragma once

#include <spdlog/formatter.h>

#include <memory>
#include <string>
#include <string_view>

namespace splid {

// Lines for systemd's journal, which takes each from standard error and, where it begins with <N>,
// as of priority N (sd-daemon(3)): so that journalctl -p warning shows the warnings.

// Standard error goes to the journal itself: JOURNAL_STREAM names the file that it is.
bool stderr_is_journal();

// "<4>warning: the first line", "<4>the second line": as on a terminal, but without the time, which
// the journal has itself.
std::unique_ptr<spdlog::formatter> journal_formatter();

// `text` as it is; for the journal each of its lines with the priority of an error.
std::string error_lines(std::string_view text, bool for_journal);

}  // namespace splid
