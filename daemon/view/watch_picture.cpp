#include "daemon/view/watch_picture.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "daemon/base/text.hpp"
#include "daemon/view/field_picture.hpp"
#include "protocol/error.hpp"
#include "protocol/status_json.hpp"

namespace splid::view {
namespace {

using Json = nlohmann::json;

constexpr const char* red = "\033[1;31m";
constexpr const char* yellow = "\033[1;33m";
constexpr const char* green = "\033[1;32m";
constexpr const char* plain = "\033[0m";

std::string text_of(const Json& object, const char* name) {
  const auto at = object.find(name);
  return at != object.end() && at->is_string() ? at->get<std::string>() : std::string{};
}

std::uint64_t count_of(const Json& object, const char* name) {
  const auto at = object.find(name);
  if (at == object.end()) return 0;
  if (at->is_number_unsigned()) return at->get<std::uint64_t>();
  // An integer that may pass 2^53 is a string.
  return at->is_string() ? std::strtoull(at->get<std::string>().c_str(), nullptr, 10) : 0;
}

double number_of(const Json& object, const char* name) {
  const auto at = object.find(name);
  return at != object.end() && at->is_number() ? at->get<double>() : 0;
}

bool continues_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U; }

// Cut to so many characters of UTF-8. What could move the terminal's cursor becomes a space:
// reasons and names come from elsewhere.
std::string cut(std::string_view text, std::size_t columns) {
  std::string out;
  std::size_t width = 0;
  for (const char byte : text) {
    if (!continues_character(byte) && ++width > columns) break;
    const auto code = static_cast<unsigned char>(byte);
    out += code < 0x20 || code == 0x7F ? ' ' : byte;
  }
  return out;
}

// A sentence in lines of at most so many characters of ASCII, broken at blanks. What has no blank
// is left to cut().
void add_wrapped(std::vector<std::string>& to, std::string_view sentence, std::size_t columns) {
  while (sentence.size() > columns) {
    const std::size_t blank = sentence.substr(0, columns + 1).rfind(' ');
    if (blank == std::string_view::npos || blank == 0) break;
    to.emplace_back(sentence.substr(0, blank));
    sentence.remove_prefix(blank + 1);
  }
  to.emplace_back(sentence);
}

// A line that begins with a word in colour, cut to so many columns. A colour takes none.
std::string painted_and_cut(const std::string& word, const char* colour, const std::string& rest,
                            std::size_t columns, bool with_colour) {
  const std::string shown = cut(word, columns);
  const std::string after = cut(rest, columns - std::min(columns, word.size()));
  return with_colour ? colour + shown + plain + after : shown + after;
}

// Of a status: green only where frames are ok and nothing else is wrong.
const char* colour_of(const std::string& state, const std::string& measurement) {
  if (state == to_string(DaemonState::streaming) && measurement == "ok") return green;
  const bool frames_come =
      state == to_string(DaemonState::streaming) || state == to_string(DaemonState::degraded);
  const bool hold = measurement == "ok" || measurement == to_string(FrameStatus::ambiguous);
  return frames_come && !hold ? red : yellow;
}

const char* colour_of(FrameStatus status) {
  if (status == FrameStatus::ok) return green;
  return status == FrameStatus::ambiguous ? yellow : red;
}

std::string number(fmt::format_string<double> pattern, const std::optional<double>& value,
                   double factor, int width) {
  return value ? fmt::format(pattern, *value * factor) : fmt::format("{:>{}}", "-", width);
}

// Words that follow others on a line.
std::string set_off(const std::string& words) { return words.empty() ? words : "   " + words; }

}  // namespace

Characters terminal_characters() {
  // The first of these that is set and not empty decides, as setlocale(3) says.
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody sets it
    if (value == nullptr || *value == '\0') continue;
    const std::string_view locale = value;
    const bool utf8 = locale.find("UTF-8") != std::string_view::npos ||
                      locale.find("utf8") != std::string_view::npos;
    return utf8 ? Characters::utf8 : Characters::ascii;
  }
  return Characters::ascii;
}

WatchPicture::WatchPicture(std::string endpoint, Characters characters, std::string values)
    : endpoint_(std::move(endpoint)), characters_(characters), values_(std::move(values)) {}

void WatchPicture::take(const std::string& topic, const std::string& json) {
  if (topic == values_) take_frame(json);
  if (topic == topic_scene) take_scene(json);
  if (topic == topic_status) take_status(json);
  if (topic == topic_version) take_version(json);
}

void WatchPicture::take_status(const std::string& json) {
  const Json message = Json::parse(json, nullptr, false);
  if (!message.is_object()) return;
  WatchedStatus& status = status_.emplace();
  status.state = text_of(message, "state");
  status.measurement = text_of(message, "measurement");
  status.findings = findings_from_json(json);
  status.reason = text_of(message, "reason");
  status.device = text_of(message, "device");
  status.device_name = text_of(message, "device_name");
  status.lost_tags = count_of(message, "lost_tags");
  status.uncounted_losses = count_of(message, "uncounted_losses");
  status.frames = count_of(message, "frames");
  status.valid_frames = count_of(message, "valid_frames");
  status.ring_fill_ratio = number_of(message, "ring_fill_ratio");
  const auto recording = message.find("recording");
  if (recording == message.end() || !recording->is_object()) return;
  status.recording_state = text_of(*recording, "state");
  status.recording_file = text_of(*recording, "file");
  status.recording_bytes = count_of(*recording, "bytes");
  status.recording_seconds = number_of(*recording, "seconds");
}

void WatchPicture::take_version(const std::string& json) {
  const Json message = Json::parse(json, nullptr, false);
  if (!message.is_object()) return;
  release_ = text_of(message, "release");
  pattern_ = text_of(message, "pattern");
}

void WatchPicture::take_frame(const std::string& json) {
  try {
    frame_ = frame_from_json(json);
  } catch (const Error&) {
    ++unread_;
    return;
  }
  if (frame_->pixel.empty()) scene_.reset();  // another daemon, with one pixel
  const bool valid = frame_->valid();
  const auto if_valid = [&](const std::optional<double>& value) {
    return valid ? value : std::nullopt;
  };
  distance_.add(frame_->timestamp_s, if_valid(frame_->distance_m));
  velocity_.add(frame_->timestamp_s, if_valid(frame_->velocity_mps));
  signal_.add(frame_->timestamp_s, if_valid(frame_->signal_per_pulse));
}

void WatchPicture::take_scene(const std::string& json) {
  try {
    scene_ = scene_from_json(json);
  } catch (const Error&) {
    ++unread_;
    return;
  }
  if (frame_ && frame_->pixel.empty()) frame_.reset();
}

void WatchPicture::add_head(std::vector<std::string>& to, std::size_t columns, bool colour) const {
  std::string head = "-";
  const char* paint = yellow;
  if (!trouble_.empty()) {
    head = "no connection";
    paint = red;
  } else if (status_) {
    head = headline(status_->state, status_->measurement);
    paint = colour_of(status_->state, status_->measurement);
  }
  to.push_back(painted_and_cut(head, paint,
                               fmt::format("  {}{}{}  Ctrl-C ends", endpoint_,
                                           pattern_.empty() ? "" : "  pattern " + pattern_,
                                           release_.empty() ? "" : "  splid " + release_),
                               columns, colour));
  add_wrapped(to, !trouble_.empty() ? trouble_ : status_ ? status_->reason : "", columns);
  if (!status_) return;
  for (const FrameMessage::Finding& finding : status_->findings) {
    add_wrapped(to, with_advice(finding), columns);
  }
  to.push_back(fmt::format(
      "{} {}   device {}{}{}", trouble_.empty() ? "state" : "last heard:", status_->state,
      status_->device, status_->device_name.empty() ? "" : ": ", status_->device_name));
  to.push_back(counts());
  to.push_back(recording());
}

std::string WatchPicture::recording() const {
  const WatchedStatus& status = *status_;
  if (status.recording_state.empty()) return "recording off";
  if (status.recording_file.empty()) return "recording " + status.recording_state;
  return fmt::format("recording {}   {:.1f} MB   {:.0f} s   {}", status.recording_state,
                     static_cast<double>(status.recording_bytes) / 1e6, status.recording_seconds,
                     status.recording_file);
}

std::string WatchPicture::counts() const {
  std::string line = fmt::format("{} frames, {} valid   lost tags {}", grouped(status_->frames),
                                 grouped(status_->valid_frames), grouped(status_->lost_tags));
  if (status_->uncounted_losses > 0) {
    line += fmt::format(" and {} losses of unknown size", grouped(status_->uncounted_losses));
  }
  if (unread_ > 0) line += fmt::format("   messages that cannot be read {}", grouped(unread_));
  return line;
}

// The line with the counts and the scales is long.
void WatchPicture::add_field(std::vector<std::string>& to, std::size_t columns) const {
  const std::vector<std::string> field = field_lines(*scene_, characters_, columns);
  add_wrapped(to, field.front(), columns);
  to.insert(to.end(), field.begin() + 1, field.end());
  to.emplace_back();
}

void WatchPicture::add_values(std::vector<std::string>& to, std::size_t columns,
                              bool colour) const {
  if (!frame_) {
    to.push_back(cut("no frame yet", columns));
    return;
  }
  const FrameMessage& f = *frame_;
  to.push_back(painted_and_cut(
      (f.pixel.empty() ? "frame " : "pixel " + f.pixel + ": ") + to_string(f.status),
      colour_of(f.status),
      fmt::format("{}   effort {}   {} photons", set_off(in_words(f.findings)),
                  f.effort.value_or("-"), f.photons ? grouped(*f.photons) : "-"),
      columns, colour));
  const auto row = [&](const char* name, const std::string& value, const std::string& deviation) {
    to.push_back(fmt::format("{:<11}{}  +- {}", name, value, deviation));
  };
  row("distance", number("{:>14.5f} m      ", f.distance_m, 1, 21),
      number("{:.3g} mm", f.std_distance_m, 1e3, 0));
  row("velocity", number("{:>14.4f} m/s    ", f.velocity_mps, 1, 21),
      number("{:.3g} cm/s", f.std_velocity_mps, 1e2, 0));
  row("signal", number("{:>14.5g} /pulse ", f.signal_per_pulse, 1, 21),
      number("{:.2g} /pulse", f.std_signal_per_pulse, 1, 0));
  row("background", number("{:>14.5g} /s     ", f.background_per_s, 1, 21),
      number("{:.2g} /s", f.std_background_per_s, 1, 0));
  const auto sync = f.sync.value_or(FrameMessage::Sync{});
  to.push_back(fmt::format("SBR {}   sync drift {} ppm   jitter {} ps   latency {} ms",
                           number("{:.3g}", f.sbr, 1, 0), number("{:+.4f}", sync.drift_ppm, 1, 0),
                           number("{:.1f}", sync.jitter_ps, 1, 0),
                           number("{:.1f}", f.latency_ms, 1, 0)));
}

// The values above these lines are those of the first target.
void WatchPicture::add_further_targets(std::vector<std::string>& to) const {
  if (!frame_ || !frame_->targets) return;
  const auto& targets = *frame_->targets;
  for (std::size_t i = 1; i < targets.size(); ++i) {
    const FrameMessage::Target& target = targets[i];
    to.push_back(fmt::format("target {}   {} m +- {} mm   {} m/s +- {} cm/s   {}{}", i + 1,
                             number("{:.5f}", target.distance_m, 1, 0),
                             number("{:.3g}", target.std_distance_m, 1e3, 0),
                             number("{:.4f}", target.velocity_mps, 1, 0),
                             number("{:.3g}", target.std_velocity_mps, 1e2, 0),
                             to_string(target.status), set_off(in_words(target.findings))));
  }
}

void WatchPicture::add_sparklines(std::vector<std::string>& to, std::size_t columns) const {
  const std::size_t width = std::min<std::size_t>(columns, Sparkline::kept_s);
  const auto add = [&](const char* name, const char* unit, const Sparkline& line) {
    const auto range = line.range(width);
    const std::string span =
        range ? fmt::format("{:.7g} to {:.7g} {}", range->low, range->high, unit) : "no value";
    to.push_back(fmt::format("{}: {} in the last {} s", name, span, width));
    to.push_back(line.draw(width, characters_));
  };
  add("distance", "m", distance_);
  add("velocity", "m/s", velocity_);
  add("signal", "/pulse", signal_);
}

std::string WatchPicture::ring_bar(std::size_t columns) const {
  const double fill = status_ ? std::clamp(status_->ring_fill_ratio, 0.0, 1.0) : 0;
  const std::string end = fmt::format("] {:>3.0f} % full", fill * 100);
  const std::string begin = "ring [";
  if (columns <= begin.size() + end.size()) return begin + end;
  const std::size_t width = columns - begin.size() - end.size();
  const auto full = static_cast<std::size_t>(fill * static_cast<double>(width));
  return begin + std::string(full, '#') + std::string(width - full, '.') + end;
}

std::vector<std::string> WatchPicture::lines(Size size, bool colour) const {
  std::vector<std::string> all;
  add_head(all, size.columns, colour);
  all.emplace_back();
  if (scene_) add_field(all, size.columns);
  const bool has_values = frame_ || !scene_;
  const std::size_t status_line = has_values ? all.size() : 0;
  if (has_values) {
    add_values(all, size.columns, colour);
    add_further_targets(all);
    all.emplace_back();
    add_sparklines(all, size.columns);
    all.emplace_back();
  }
  all.push_back(ring_bar(size.columns));
  if (all.size() > size.rows) all.resize(size.rows);
  for (std::size_t i = 1; i < all.size(); ++i) {
    // The first line and that of the frame's status are cut already, and may have colours.
    if (i != status_line) all[i] = cut(all[i], size.columns);
  }
  return all;
}

}  // namespace splid::view
