#pragma once

#include <spdlog/formatter.h>

#include <memory>
#include <string>
#include <string_view>

namespace splid {

// Lines for systemd's journal. The journal reads standard error, and takes a line that begins with
// <N> as of priority N (sd-daemon(3)), so that journalctl -p warning shows the warnings.

// Whether standard error goes to the journal: JOURNAL_STREAM then names the file behind it.
bool stderr_is_journal();

// "<4>warning: the first line", "<4>the second line": as on a terminal, but without the time, which
// the journal has itself.
std::unique_ptr<spdlog::formatter> journal_formatter();

// Returns `text` as it is, or, for the journal, each line of it with the priority of an error.
std::string error_lines(std::string_view text, bool for_journal);

}  // namespace splid
