#pragma once

#include <functional>
#include <string>

namespace splid {

// A file that is always whole: written beside itself and renamed, readable by everybody, whatever
// the umask.
//
// Threads: one. Errors: none; what keeps it from being written is said once, and once more when it
// is written again.
class MetricsFile {
 public:
  // notice: takes a sentence.
  MetricsFile(std::string path, std::function<void(const std::string&)> notice);

  // Waits for the disk; a folder in memory, such as /run/splid, makes it wait for nothing.
  void write(const std::string& text);

 private:
  std::string path_;
  std::string temporary_;
  std::function<void(const std::string&)> notice_;
  bool failing_ = false;
};

}  // namespace splid
