#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace splid::recording {

// The folder of a daemon's recordings. Their names are like splid-20261121T201500Z-000001.ptu: the
// UTC time of the first tag, and a running number that goes on from the highest number in the
// folder. Since a daemon removes old files, a folder belongs to one daemon at a time: from the
// first next() on, no other daemon can use it.
//
// Threads: one. Errors: Error(Fault::device), which names the folder and says which file stands in
// the way or that another daemon uses the folder.
class Folder {
 public:
  // path: the folder need not exist yet. max_bytes: limit for all recordings in it together with
  // the files beside them.
  Folder(std::string path, std::uint64_t max_bytes)
      : path_(std::move(path)), max_bytes_(max_bytes) {}
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  // The path for the next recording. Makes the folder, and removes the oldest recordings until
  // file_bytes more are within the limit; files with other names are neither counted nor touched.
  // To be called only while no recording is being written.
  std::string next(double unix_s, std::uint64_t file_bytes);
  // Free room on the folder's disk, as a user other than root has it.
  [[nodiscard]] std::uint64_t free_bytes() const;

 private:
  void lock();

  std::string path_;
  std::uint64_t max_bytes_;
  std::uint64_t number_ = 0;  // of the last path given
  int lock_ = -1;             // descriptor of the locked folder; -1: not locked yet
};

}  // namespace splid::recording
