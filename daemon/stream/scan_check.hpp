#pragma once

#include <string>

#include "daemon/stream/framer.hpp"

namespace splid {

// What is wrong with the lines of a scan, in a sentence with what to do; empty where nothing is,
// and where frames are cut by time.
std::string scan_fault(const FramerTotals& totals);

// At the end of a stream. Errors: Error(Fault::data) where a scan has made no frame; of lines
// without an end, and of a first picture that is not whole, the log has a warning.
void check_scan(const FramerTotals& totals);

}  // namespace splid
