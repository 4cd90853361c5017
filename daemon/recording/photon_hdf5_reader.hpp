#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/recording/photon_hdf5_pipe.hpp"
#include "protocol/recording_header.hpp"
#include "protocol/tag.hpp"

namespace splid::recording {

// Whether a file's first bytes are those of HDF5; false too where it cannot be read. What tells
// Photon-HDF5 from other HDF5 files stands further on.
bool begins_as_hdf5(const std::string& file);

// Reads a Photon-HDF5 file by a process of its own, so that a file on which the HDF5 library
// crashes, or never returns, is an error like any other. The process is this very program, as
// `splid read-photon-hdf5 FILE`; it ends with this object.
//
// Threads: one. Errors: Error(Fault::data) with the file and the place in it; Error(Fault::device)
// where no process can be started.
class PhotonHdf5Reader {
 public:
  using Warn = std::function<void(const std::string&)>;

  // Reads what stands beside the photons. warn: never empty. A stop ends each wait.
  PhotonHdf5Reader(std::string file, Warn warn, std::stop_token stop = {});
  ~PhotonHdf5Reader();
  PhotonHdf5Reader(const PhotonHdf5Reader&) = delete;
  PhotonHdf5Reader& operator=(const PhotonHdf5Reader&) = delete;

  [[nodiscard]] const RecordingHeader& header() const { return header_; }

  // Writes the next tags and returns their number, 0 at the end, and once a stop was requested. In
  // T3 sync k is at k times whole_period_ps().
  std::size_t read(std::span<Tag> out);

  // The photons that were read so far, and the time of the last tag.
  [[nodiscard]] std::uint64_t photons() const { return photons_; }
  [[nodiscard]] std::int64_t reached_ps() const { return reached_ps_; }

 private:
  void start();
  // Takes parts until there are tags, or the end.
  void next_part();
  // False where a stop came.
  bool read_all(std::span<std::byte> to);
  [[noreturn]] void say_how_it_ended();
  int end_process();

  std::string file_;
  Warn warn_;
  std::stop_token stop_;
  pid_t process_ = -1;
  int descriptor_ = -1;
  RecordingHeader header_;
  std::vector<Tag> tags_;
  std::size_t taken_ = 0;  // of tags_
  bool ended_ = false;
  std::uint64_t photons_ = 0;
  std::int64_t reached_ps_ = 0;
};

}  // namespace splid::recording
