#include <fmt/format.h>

#include <array>
#include <iterator>

#include "daemon/cloud/encoding.hpp"
#include "protocol/error.hpp"

// Formats without a head: Open3D's .xyzd, and rows of float32 as programs of Doppler odometry read
// them. They have no room for a unit or a comment: Open3D takes each line for a point.

namespace splid::cloud {
namespace {

class Xyzd : public Encoding {
 public:
  [[nodiscard]] std::string head(const Summary& /*cloud*/) const override { return {}; }
  void append(const Point& point, const Summary& /*cloud*/, std::string& out) const override {
    fmt::format_to(std::back_inserter(out), "{:.6f} {:.6f} {:.6f} {:.6f}\n", point.x, point.y,
                   point.z, point.radial_velocity);
  }
};

constexpr double ns_in_a_second = 1e9;

struct Layout {
  const char* name;
  bool has_intensity;
  double times_in_a_second;  // that the time counts from the cloud's first point; 0: no time
};

// STEAM-ICP counts the time of `x y z v t` in ns and that of Boreas' Aeva clouds in s.
constexpr std::array<Layout, 3> layouts{
    {{"dicp", false, 0}, {"aeva", false, ns_in_a_second}, {"boreas", true, 1}}};

class Rows : public Encoding {
 public:
  explicit Rows(const Layout& layout) : layout_(layout) {}

  [[nodiscard]] std::string head(const Summary& /*cloud*/) const override { return {}; }
  void append(const Point& point, const Summary& cloud, std::string& out) const override {
    for (const double place : {point.x, point.y, point.z}) append_float(place, out);
    if (layout_.has_intensity) append_float(point.signal_per_pulse, out);
    append_float(point.radial_velocity, out);
    if (layout_.times_in_a_second > 0) {
      append_float((point.time_s - cloud.first_time_s) * layout_.times_in_a_second, out);
    }
  }

 private:
  Layout layout_;
};

}  // namespace

std::unique_ptr<Encoding> xyzd_encoding() { return std::make_unique<Xyzd>(); }

std::unique_ptr<Encoding> rows_encoding(const std::string& layout) {
  for (const Layout& known : layouts) {
    if (layout == known.name) return std::make_unique<Rows>(known);
  }
  throw Error(Fault::usage,
              std::string(layout.empty() ? "--layout is missing" : "--layout " + layout) +
                  ": rows of .bin are dicp (x y z v), aeva (x y z v t) or boreas (x y z intensity "
                  "v t)");
}

}  // namespace splid::cloud
