#pragma once

#include <string>

namespace splid {

// What `splid check` prints of a recording, in lines for people: its record type, its counts by
// channel, times, rates, the sync period found in it, and splid's own facts in its header. Reads
// the whole file.
//
// Errors: Error(Fault::data) with the file and the byte offset where the file cannot be decoded.
std::string report_recording(const std::string& file);

}  // namespace splid
