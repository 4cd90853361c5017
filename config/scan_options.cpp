#include "config/scan_options.hpp"

#include <string_view>

#include "config/channel_name.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

constexpr std::string_view by_marker = "marker:";
constexpr std::string_view by_line = "line:";
constexpr std::int64_t most_bits = 15;

std::optional<std::int64_t> number_within(std::string_view text, std::int64_t most) {
  const auto value = whole_number(text);
  return value && *value >= 1 && *value <= most ? value : std::nullopt;
}

// Reads `marker:N` and `line:START:STOP:PIXELS`.
std::optional<ScanLines> parse_lines(std::string_view by) {
  ScanLines scan;
  if (by.starts_with(by_marker)) {
    const auto bits = number_within(by.substr(by_marker.size()), most_bits);
    if (!bits) return std::nullopt;
    scan.start = scan.stop = static_cast<int>(*bits);
    return scan;
  }
  if (!by.starts_with(by_line)) return std::nullopt;
  std::string_view rest = by.substr(by_line.size());
  const auto start = number_within(take_until(rest, ':'), most_bits);
  const auto stop = number_within(take_until(rest, ':'), most_bits);
  const auto pixels = number_within(rest, most_dwells);
  if (!start || !stop || !pixels) return std::nullopt;
  scan.start = static_cast<int>(*start);
  scan.stop = static_cast<int>(*stop);
  scan.pixels = *pixels;
  return scan;
}

std::optional<OptionFault> scale_fault(const char* pointer, const std::vector<double>& ends) {
  if (ends.empty() || ends.size() == 2) return std::nullopt;
  return OptionFault{pointer, "has " + std::to_string(ends.size()) +
                                  " angles; two are needed: of the first and of the last"};
}

}  // namespace

void ScanOptions::describe(OptionVisitor& visitor) {
  visitor.channel("picture", picture,
                  "marker at the start of a picture, as in marker:4; the line after it is line 0; "
                  "\"\": none");
  visitor.integer("lines", lines, 0, most_dwells, "lines of a picture; 0: not known");
  visitor.flag("both_ways", both_ways,
               "every second line of a picture runs back: its first dwell is the last pixel");
  visitor.number("sine_percent", sine_percent, {0, 100},
                 "share of a sinusoidal mirror's half swing that a line takes, %; the dwells are "
                 "then equal in angle; 0: equal in time");
  visitor.numbers("azimuth_deg", azimuth_deg, {-360, 360},
                  "azimuth of the first and of the last pixel of a line, to the right, degrees");
  visitor.numbers("elevation_deg", elevation_deg, {-90, 90},
                  "elevation of the first and of the last line of a picture, up, degrees");
  visitor.path("angles", angles,
               "file of angles read from the scanner, instead of azimuth_deg and elevation_deg: "
               "CSV with the columns "
               "azimuth_deg,elevation_deg and a row for each tick of channels.encoder");
}

std::optional<OptionFault> ScanOptions::validate(const ChannelOptions& channels) const {
  const auto marker = parse_channel(picture);
  if (!picture.empty() && (!marker || marker->kind != TagKind::marker)) {
    return OptionFault{"/picture", "\"" + picture + "\" is no marker, such as marker:4"};
  }
  if (auto fault = scale_fault("/azimuth_deg", azimuth_deg)) return fault;
  if (auto fault = scale_fault("/elevation_deg", elevation_deg)) return fault;
  if (!elevation_deg.empty() && lines == 0) {
    return OptionFault{"/elevation_deg",
                       "is of the first and the last line; give their number, /scan/lines"};
  }
  if (angles.empty()) return std::nullopt;
  if (!azimuth_deg.empty() || !elevation_deg.empty()) {
    return OptionFault{"/angles", "the angles already come from a scale; remove one of the two"};
  }
  if (!channels.encoder.empty()) return std::nullopt;
  return OptionFault{"/angles",
                     "its rows are joined to the ticks of /channels/encoder, which is "
                     "\"\"; name the channel of the ticks"};
}

std::optional<OptionFault> frame_by_fault(const std::string& by) {
  if (by == "auto" || by == "time" || parse_lines(by)) return std::nullopt;
  return OptionFault{"/by", "\"" + by +
                                "\" is not auto, time, marker:N or line:START:STOP:PIXELS, where "
                                "N, START and STOP are marker bits, 1 to 15, and PIXELS is from 1 "
                                "to 65536"};
}

std::optional<ScanLines> scan_lines(const std::string& by, const ScanOptions& options,
                                    const std::optional<ScanLines>& told) {
  std::optional<ScanLines> scan = by == "auto" ? told : parse_lines(by);
  if (!scan) return std::nullopt;
  if (!options.picture.empty()) scan->picture = parse_channel(options.picture).value().value;
  if (options.lines > 0) scan->lines = options.lines;
  scan->both_ways = scan->both_ways || options.both_ways;
  if (options.sine_percent > 0) scan->sine_percent = options.sine_percent;
  return scan;
}

}  // namespace splid
