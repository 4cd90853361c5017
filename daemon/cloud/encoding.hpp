#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include "daemon/cloud/point.hpp"

namespace splid::cloud {

// What a format's head may tell of all points of a cloud.
struct Summary {
  std::uint64_t points = 0;
  double first_time_s = 0;  // of the point that came first
  std::array<double, 3> least{};
  std::array<double, 3> most{};

  void add(const Point& point);
};

// A format of clouds: a head, and then the points one after the other.
//
// Threads: one. Errors: see append().
class Encoding {
 public:
  virtual ~Encoding() = default;
  // As many bytes for every summary: the head is written before the first point, and again when all
  // points are known.
  [[nodiscard]] virtual std::string head(const Summary& cloud) const = 0;
  // Appends a point of the cloud to `out`. cloud: with this point. Errors: Error(Fault::data) where
  // the format cannot hold the point.
  virtual void append(const Point& point, const Summary& cloud, std::string& out) const = 0;
};

// The format, as the command line names it.
struct FormatOptions {
  std::string file;            // whose name ends in .pcd, .ply, .las, .xyzd or .bin
  bool ascii = false;          // .pcd and .ply: as text
  std::string layout;          // .bin: dicp, aeva or boreas
  double largest_range_m = 0;  // that the pattern can tell
};

// Errors: Error(Fault::usage) for another name, and for options that do not fit it.
std::unique_ptr<Encoding> make_encoding(const FormatOptions& options);

// The formats, one a file.
std::unique_ptr<Encoding> pcd_encoding(bool ascii);
std::unique_ptr<Encoding> ply_encoding(bool ascii);
// Places are whole numbers of a step: 0.1 mm, or a power of ten times that where the largest range
// needs it.
std::unique_ptr<Encoding> las_encoding(double largest_range_m);
std::unique_ptr<Encoding> xyzd_encoding();
// Errors: Error(Fault::usage) for a layout that is not known.
std::unique_ptr<Encoding> rows_encoding(const std::string& layout);

// What the heads say to people about all of a point's values.
inline constexpr const char* axes_in_words = "x ahead, y to the left, z up, m from the lidar";

// A point's place as float32 and its columns, one behind the other, little-endian: as PCD and PLY
// have it.
void append_binary(const Point& point, std::string& out);
// The same as numbers with blanks between, and a line feed.
void append_text(const Point& point, std::string& out);
// As many blanks as a count has digits less than the largest has.
std::string blanks_beside(std::uint64_t count);

// Appends the bytes of a number, the least first.
void append_number(std::uint64_t value, unsigned bytes, std::string& out);
void append_float(double value, std::string& out);
void append_double(double value, std::string& out);

}  // namespace splid::cloud
