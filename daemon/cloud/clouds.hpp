#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/cloud/cloud_file.hpp"
#include "daemon/cloud/encoding.hpp"
#include "daemon/cloud/point.hpp"

namespace splid::cloud {

// The name of a frame's cloud: of `name`, `%d` or `%06d` becomes the frame's number, and `%t` its
// time, UTC in us. Errors: none.
std::string name_of_frame(const std::string& name, std::uint64_t frame, double time_s);

// Points go into one cloud; or, where its name has a place for a frame's number or time, into one
// for each frame that has points, as programs of odometry want it.
//
// Threads: one. Errors: those of File and of check_may_write() for each file, and of
// make_encoding().
class Clouds {
 public:
  Clouds(FormatOptions options, bool overwrite);

  // frame: the points of a frame come together.
  void add(const Point& point, std::uint64_t frame);
  // The last point was added.
  void finish();

  [[nodiscard]] bool are_many() const { return are_many_; }
  [[nodiscard]] std::uint64_t points() const { return points_; }
  [[nodiscard]] std::uint64_t files() const { return files_; }

 private:
  void open(const std::string& name);

  FormatOptions options_;
  bool overwrite_;
  bool are_many_;
  std::uint64_t points_ = 0;
  std::uint64_t files_ = 0;  // that have got their name
  std::uint64_t frame_ = 0;  // of file_
  std::optional<File> file_;
};

}  // namespace splid::cloud
