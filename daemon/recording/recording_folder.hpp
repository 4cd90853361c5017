#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace splid {

// The folder of a daemon's recordings: splid-20261121T201500Z-000001.ptu, UTC of the first tag and
// a running number that goes on where the folder's files end. A folder belongs to one daemon at a
// time, which removes old files in it: from the first next() on no other can use it.
//
// Threads: one. Errors: Error(Fault::device) naming the folder, and the file that stands in the
// way, or that another daemon uses it.
class RecordingFolder {
 public:
  // path: need not be there yet. max_bytes: of the recordings in it, with what is beside them.
  RecordingFolder(std::string path, std::uint64_t max_bytes)
      : path_(std::move(path)), max_bytes_(max_bytes) {}
  ~RecordingFolder();
  RecordingFolder(const RecordingFolder&) = delete;
  RecordingFolder& operator=(const RecordingFolder&) = delete;

  // Where the next recording goes. Makes the folder, and removes its oldest recordings until
  // file_bytes more are within the limit; files of other names are neither counted nor touched.
  // Call it when no file is being written.
  std::string next(double unix_s, std::uint64_t file_bytes);
  // Room on the disk for those who are not root.
  [[nodiscard]] std::uint64_t free_bytes() const;

 private:
  void lock();

  std::string path_;
  std::uint64_t max_bytes_;
  std::uint64_t number_ = 0;  // the last one given
  int lock_ = -1;             // the folder, open; -1: not yet
};

}  // namespace splid
