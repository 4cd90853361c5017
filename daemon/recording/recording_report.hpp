#pragma once

#include <string>

namespace splid {

// What a PTU recording holds, in lines for people: record type, counts by channel, times, rates,
// the sync period found, splid's own facts. Reads the whole file.
//
// Errors: Error(Fault::data) with the file and the byte offset where it cannot be decoded.
std::string report_recording(const std::string& file);

}  // namespace splid
