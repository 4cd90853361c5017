#include "daemon/stream/scan_directions.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

#include "config/read_file.hpp"
#include "protocol/error.hpp"
#include "protocol/shown_text.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

constexpr std::string_view angle_columns = "azimuth_deg,elevation_deg";
constexpr std::size_t most_quoted_text = 60;

// Part k of n steps from the first to the last of two ends; the first where there is no step.
std::optional<double> on_scale(const std::vector<double>& ends, std::int64_t k, std::int64_t n) {
  if (ends.empty()) return std::nullopt;
  const double part = n > 0 ? static_cast<double>(k) / static_cast<double>(n) : 0;
  return ends[0] + part * (ends[1] - ends[0]);
}

std::optional<double> number_of(std::string_view text) {
  text = trimmed(text);
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && stop == end && std::isfinite(value) ? std::optional(value)
                                                                     : std::nullopt;
}

}  // namespace

ScanDirections::ScanDirections(const ScanOptions& options) : options_(options) {
  if (options.angles.empty()) return;
  const std::string text = read_file(options.angles, "/scan/angles: ");
  std::string_view rest = without_byte_order_mark(text);
  bool has_columns = false;
  for (std::size_t number = 1; !rest.empty(); ++number) {
    std::string_view line = trimmed(take_until(rest, '\n'));
    if (line.empty() || line.starts_with('#')) continue;
    if (!has_columns && line == angle_columns) {
      has_columns = true;
      continue;
    }
    const std::string shown_line = shown_text(line, most_quoted_text);
    const auto azimuth_deg = number_of(take_until(line, ','));
    const auto elevation_deg = number_of(line);
    if (!has_columns || !azimuth_deg || !elevation_deg) {
      throw Error(Fault::usage,
                  "/scan/angles: " + options.angles + ": line " + std::to_string(number) + ": " +
                      shown_line +
                      (has_columns ? " is not two angles in degrees, such as -4.2,0.5"
                                   : " is not the first line " + std::string(angle_columns)));
    }
    rows_.push_back({*azimuth_deg, *elevation_deg});
  }
  if (rows_.empty()) {
    throw Error(Fault::usage, "/scan/angles: " + options.angles + ": has no angles; write a line " +
                                  std::string(angle_columns) + " and a row for each tick");
  }
}

ScanDirection ScanDirections::of(const ScanPlace& place) const {
  if (rows_.empty()) {
    std::int64_t line = place.line;
    if (options_.lines > 0) line %= options_.lines;
    return {on_scale(options_.azimuth_deg, place.column, place.columns - 1),
            on_scale(options_.elevation_deg, line, options_.lines - 1)};
  }
  if (!(place.tick >= 0) || place.tick > static_cast<double>(rows_.size() - 1)) return {};
  const auto before = static_cast<std::size_t>(place.tick);
  const Angles& a = rows_[before];
  const Angles& b = rows_[std::min(before + 1, rows_.size() - 1)];
  const double part = place.tick - static_cast<double>(before);
  // The shorter way round, where azimuth passes 360 degrees.
  const double turn = std::remainder(b.azimuth_deg - a.azimuth_deg, 360);
  return {a.azimuth_deg + part * turn,
          a.elevation_deg + part * (b.elevation_deg - a.elevation_deg)};
}

}  // namespace splid
