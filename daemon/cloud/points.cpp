#include "daemon/cloud/points.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "daemon/base/text.hpp"
#include "protocol/error.hpp"

namespace splid::cloud {
namespace {

constexpr double degree = std::numbers::pi / 180;

constexpr const char* example =
    R"({"input": 1, "azimuth_deg": 0, "elevation_deg": 0}: degrees to the right and up)";

[[noreturn]] void refuse(const Config& config, const std::string& what) {
  throw Error(Fault::usage, config.file + ": /pixels: a cloud needs the direction of each pixel; " +
                                what + ", such as " + example);
}

double or_none(const std::optional<double>& value) {
  return value.value_or(std::numeric_limits<double>::quiet_NaN());
}

// The values that a frame and one of its targets both have.
template <class Seen>
Point values_of(const Seen& seen) {
  Point point;
  point.radial_velocity = or_none(seen.velocity_mps);
  point.std_radial_velocity = or_none(seen.std_velocity_mps);
  point.std_distance = or_none(seen.std_distance_m);
  point.signal_per_pulse = or_none(seen.signal_per_pulse);
  point.significance = or_none(seen.significance);
  return point;
}

}  // namespace

Points::Points(const Config& config) {
  if (config.pixels.empty()) {
    refuse(config, "there is no list of pixels; set pixels instead of channels.photon, with");
  }
  for (const PixelOptions& pixel : config.pixels) {
    if (!pixel.azimuth_deg || !pixel.elevation_deg) {
      const char* missing = pixel.azimuth_deg ? "elevation_deg" : "azimuth_deg";
      refuse(config, "pixel " + pixel.name + " has no " + missing + "; give it both angles");
    }
    const double azimuth = *pixel.azimuth_deg * degree;
    const double elevation = *pixel.elevation_deg * degree;
    places_.emplace(pixel.name, directions_.size());
    // Straight ahead is 0 to the left, and not -0.
    directions_.push_back({std::cos(elevation) * std::cos(azimuth),
                           0 - std::cos(elevation) * std::sin(azimuth), std::sin(elevation)});
  }
}

void Points::add(const FrameMessage& frame, const Take& take) {
  ++frames_;
  // The frames of a single pixel have no name.
  const std::size_t place = frame.pixel.empty() ? 0 : places_.at(frame.pixel);
  const Direction& direction = directions_.at(place);
  bool any = false;
  const auto put = [&](const auto& seen) {
    const bool is_ambiguous = seen.status == FrameStatus::ambiguous;
    if ((seen.status != FrameStatus::ok && !is_ambiguous) || !seen.distance_m) return;
    Point point = values_of(seen);
    point.x = *seen.distance_m * direction.ahead;
    point.y = *seen.distance_m * direction.left;
    point.z = *seen.distance_m * direction.up;
    point.background_per_s = or_none(frame.background_per_s);
    point.time_s = frame.timestamp_s;
    point.pixel = static_cast<std::uint32_t>(place);
    ambiguous_ += is_ambiguous ? 1 : 0;
    any = true;
    take(point);
  };
  if (frame.valid() && frame.targets) {
    for (const FrameMessage::Target& target : *frame.targets) put(target);
  } else {
    put(frame);
  }
  if (!any) ++left_out_.at(static_cast<std::size_t>(frame.status));
}

std::string Points::left_out() const {
  std::string text;
  for (std::size_t i = 0; i < left_out_.size(); ++i) {
    if (left_out_[i] == 0) continue;
    text += (text.empty() ? "" : ", ") + grouped(left_out_[i]) + " ";
    text += frame_status_names.at(i);
  }
  return text;
}

}  // namespace splid::cloud
