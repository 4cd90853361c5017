#pragma once

#include <functional>
#include <string>

namespace splid {

// A file that is always whole: written beside itself and renamed, readable by everybody, whatever
// the umask.
//
// Threads: one. Errors: none; a notice says once why the file cannot be written, and once that it
// is written again.
class MetricsFile {
 public:
  // notice: takes a sentence.
  MetricsFile(std::string path, std::function<void(const std::string&)> notice);

  // Waits for the disk, but not in a folder in memory such as /run/splid.
  void write(const std::string& text);

 private:
  std::string path_;
  std::string temporary_;
  std::function<void(const std::string&)> notice_;
  bool failing_ = false;
};

}  // namespace splid
