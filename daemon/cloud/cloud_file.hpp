#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "daemon/cloud/encoding.hpp"
#include "daemon/cloud/point.hpp"

namespace splid::cloud {

// Writes points into a file, in bounded memory. The file gets its name when it is whole: until then
// it is FILE.part, which goes with this object.
//
// Threads: one. Errors: Error(Fault::device) with the file and the errno text where it cannot be
// written; those of Encoding::append().
class File {
 public:
  File(std::string file, std::unique_ptr<Encoding> encoding);
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void add(const Point& point);
  // The last point was added.
  void finish();
  [[nodiscard]] std::uint64_t points() const { return summary_.points; }

 private:
  void flush();
  void write_at(const std::string& bytes, std::uint64_t offset) const;
  [[noreturn]] void fail() const;

  std::string file_;
  std::string part_;
  std::unique_ptr<Encoding> encoding_;
  Summary summary_;
  std::string waiting_;    // bytes that are not written yet
  std::uint64_t end_ = 0;  // of what is written
  int descriptor_ = -1;
};

}  // namespace splid::cloud
