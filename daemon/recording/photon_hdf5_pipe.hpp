#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/recording_header.hpp"

namespace splid::recording {

// What the process that reads a Photon-HDF5 file tells the process that asked for it, by a pipe: a
// head of 8 bytes, and behind it as many bytes as the head says. Both run the same program, so that
// tags go as they lie in memory.
enum class PhotonHdf5Part : std::uint32_t {
  header = 1,   // JSON
  warning = 2,  // text
  tags = 3,     // Tag
  error = 4,    // text; the last part
  end = 5,      // nothing; the last part
};

struct PhotonHdf5PartHead {
  PhotonHdf5Part part = PhotonHdf5Part::end;
  std::uint32_t bytes = 0;
};

// The parts of a header that a Photon-HDF5 file has.
std::string photon_hdf5_header_json(const RecordingHeader& header);
RecordingHeader photon_hdf5_header_from_json(std::string_view json);

// The period by which the syncs of a recording in T3 mode become times for its conversion: a whole
// number of ps, 1 at least, so that a sync's number comes back from its time.
std::int64_t whole_period_ps(const RecordingHeader& header);

// Reads the file and writes all of it to the descriptor, warnings and errors included.
// Threads: one. Errors: none but for those of memory; they are written.
void write_photon_hdf5(const std::string& file, int descriptor);

}  // namespace splid::recording
