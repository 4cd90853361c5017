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

[[noreturn]] void refuse_scan(const std::string& file) {
  throw Error(Fault::usage, file +
                                ": /scan: a cloud of a scan needs the directions of its dwells; "
                                "give azimuth_deg and elevation_deg, of the first and the last, "
                                "or the scanner's own angles (docs/guide/scan.md)");
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

Points::Points(const Config& config)
    : config_file_(config.file), is_scan_(config.scan.has_directions()) {
  if (!is_scan_ && config.frame.by.starts_with("line:")) refuse_scan(config_file_);
  if (!is_scan_ && config.pixels.empty()) {
    refuse(config,
           "there is no list of pixels; set the angles of /scan for a scan (docs/guide/scan.md), "
           "else pixels instead of channels.photon");
  }
  for (const PixelOptions& pixel : config.pixels) {
    if (!is_scan_ && (!pixel.azimuth_deg || !pixel.elevation_deg)) {
      const char* missing = pixel.azimuth_deg ? "elevation_deg" : "azimuth_deg";
      refuse(config, "pixel " + pixel.name + " has no " + missing + "; give it both angles");
    }
    places_.emplace(pixel.name, directions_.size());
    directions_.push_back(
        direction_of(pixel.azimuth_deg.value_or(0), pixel.elevation_deg.value_or(0)));
  }
}

Points::Direction Points::direction_of(double azimuth_deg, double elevation_deg) {
  const double azimuth = azimuth_deg * degree;
  const double elevation = elevation_deg * degree;
  // Straight ahead is 0 to the left, and not -0.
  return {std::cos(elevation) * std::cos(azimuth), 0 - std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

std::optional<Points::Direction> Points::direction_of(const FrameMessage& frame,
                                                      std::size_t place) const {
  if (!is_scan_) {
    if (frame.scan && frame.scan->column > 0) refuse_scan(config_file_);
    return directions_.at(place);
  }
  if (!frame.scan || (!frame.scan->azimuth_deg && !frame.scan->elevation_deg)) return std::nullopt;
  return direction_of(frame.scan->azimuth_deg.value_or(0), frame.scan->elevation_deg.value_or(0));
}

void Points::add(const FrameMessage& frame, const Take& take) {
  ++frames_;
  // The frames of a single pixel have no name.
  const std::size_t place = frame.pixel.empty() ? 0 : places_.at(frame.pixel);
  const std::optional<Direction> direction = direction_of(frame, place);
  if (!direction && frame.valid()) {
    ++without_direction_;
    return;
  }
  bool any = false;
  const auto put = [&](const auto& seen) {
    const bool is_ambiguous = seen.status == FrameStatus::ambiguous;
    if ((seen.status != FrameStatus::ok && !is_ambiguous) || !seen.distance_m) return;
    Point point = values_of(seen);
    point.x = *seen.distance_m * direction->ahead;
    point.y = *seen.distance_m * direction->left;
    point.z = *seen.distance_m * direction->up;
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
