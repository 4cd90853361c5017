#include "daemon/cloud/encoding.hpp"

#include <fmt/format.h>

#include <bit>
#include <filesystem>
#include <iterator>

#include "protocol/error.hpp"

namespace splid::cloud {

void Summary::add(const Point& point) {
  const std::array<double, 3> place{point.x, point.y, point.z};
  if (points++ == 0) {
    first_time_s = point.time_s;
    least = most = place;
    return;
  }
  for (std::size_t i = 0; i < place.size(); ++i) {
    least[i] = std::min(least[i], place[i]);
    most[i] = std::max(most[i], place[i]);
  }
}

std::unique_ptr<Encoding> make_encoding(const FormatOptions& options) {
  const std::string suffix = std::filesystem::path(options.file).extension().string();
  const bool has_text = suffix == ".pcd" || suffix == ".ply";
  if (options.ascii && !has_text) {
    throw Error(Fault::usage, "--ascii is for .pcd and .ply, and " + options.file + " is neither");
  }
  if (!options.layout.empty() && suffix != ".bin") {
    throw Error(Fault::usage, "--layout is for .bin, and " + options.file + " is none");
  }
  if (suffix == ".pcd") return pcd_encoding(options.ascii);
  if (suffix == ".ply") return ply_encoding(options.ascii);
  if (suffix == ".las") return las_encoding(options.largest_range_m);
  if (suffix == ".xyzd") return xyzd_encoding();
  if (suffix == ".bin") return rows_encoding(options.layout);
  throw Error(Fault::usage, "--output " + options.file +
                                ": a cloud's name ends in .pcd, .ply, .las, .xyzd or .bin");
}

void append_number(std::uint64_t value, unsigned bytes, std::string& out) {
  for (unsigned i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 0xFFU);
}

void append_float(double value, std::string& out) {
  append_number(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4, out);
}

void append_double(double value, std::string& out) {
  append_number(std::bit_cast<std::uint64_t>(value), 8, out);
}

void append_binary(const Point& point, std::string& out) {
  for (const double place : {point.x, point.y, point.z}) append_float(place, out);
  for (const Column& column : columns) {
    switch (column.kind) {
      case Kind::float32:
        append_float(point.*column.value, out);
        break;
      case Kind::float64:
        append_double(point.*column.value, out);
        break;
      case Kind::uint32:
        append_number(point.pixel, bytes_of(column.kind), out);
        break;
    }
  }
}

void append_text(const Point& point, std::string& out) {
  const auto put = [&out](auto value) { fmt::format_to(std::back_inserter(out), "{} ", value); };
  for (const double place : {point.x, point.y, point.z}) put(static_cast<float>(place));
  for (const Column& column : columns) {
    switch (column.kind) {
      case Kind::float32:
        put(static_cast<float>(point.*column.value));
        break;
      case Kind::float64:
        put(point.*column.value);
        break;
      case Kind::uint32:
        put(point.pixel);
        break;
    }
  }
  out.back() = '\n';
}

std::string blanks_beside(std::uint64_t count) {
  constexpr std::size_t most_digits = std::numeric_limits<std::uint64_t>::digits10 + 1;
  return std::string(most_digits - std::to_string(count).size(), ' ');
}

}  // namespace splid::cloud
