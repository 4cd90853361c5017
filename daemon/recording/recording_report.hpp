#pragma once

#include <string>

namespace splid::recording {

// What `splid check` prints of a recording, in lines for people: its record type, its counts by
// channel, times, rates, the sync period found in it, and splid's own facts in its header. Reads
// the whole file.
//
// Errors: Error(Fault::data) with the file and the byte offset where the file cannot be decoded.
std::string report_of(const std::string& file);

// What `splid check` prints of a Photon-HDF5 file, which ends with how splid convert makes a
// recording of it.
//
// Errors: Error(Fault::data) with the file where it cannot be read or is no Photon-HDF5 file.
std::string report_photon_hdf5(const std::string& file);

}  // namespace splid::recording
