#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_members.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/shown_text.hpp"
#include "protocol/status_json.hpp"

// The members of the `status` and `version` messages, each named once: the JSON and the manual's
// tables are visitors of describe(), as of a frame's (protocol/frame_members.hpp).

namespace splid {

inline std::string json_names(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ",") + json_string(name);
  return names.empty() ? "" : "[" + list + "]";
}

inline std::string json_counts_by_name(const std::map<std::string, std::size_t>& counts) {
  JsonWriter json;
  for (const auto& [name, count] : counts) json.integer(name, count);
  return counts.empty() ? "" : json.finish();
}

template <class Visitor>
void describe_pixels(const PixelsStatus& pixels, Visitor& see) {
  see.count({"count", "", "number of pixels"}, pixels.count);
  see.json({"by_status", "", "number of pixels with each status in the last frame"},
           json_counts_by_name(pixels.by_status));
  see.count({"dark", "", "pixels without a photon in the last second"}, pixels.dark);
  see.count({"hot", "", "pixels with more photons than a frame can hold, or 20 times the median"},
            pixels.hot);
  see.json({"dark_names", "", "names of the dark pixels, at most 16"},
           json_names(pixels.dark_names));
  see.json({"hot_names", "", "names of the hot pixels, at most 16"}, json_names(pixels.hot_names));
}

template <class Visitor>
void describe_recording(const RecordingStatus& recording, Visitor& see) {
  const bool has_file = !recording.file.empty();
  see.choice({"state", "", "`waiting` (for a tag), `writing` or `failing`"}, recording.state);
  see.text_if_any({"file", "", "current file"}, recording.file);
  see.count({"bytes", "", "size of this file"},
            has_file ? std::optional(recording.bytes) : std::nullopt);
  see.number({"seconds", "s", "length of this file"},
             has_file ? std::optional(recording.seconds) : std::nullopt);
}

template <class Visitor>
void describe(const StatusMessage& message, Visitor& see) {
  see.choice(
      {"state", "", "`starting`, `waiting_for_device`, `streaming`, `degraded` or `stopping`"},
      message.state);
  see.text({"measurement", "",
            "`ok` while most frames of the last second are `ok`; else the most frequent of "
            "`no_target`, `ambiguous`, `saturated`, `incomplete`, `no_sync`, `wrong_pattern`, "
            "`no_signal` (no photon); `none` if there was no frame"},
           message.measurement);
  see.text({"reason", "",
            "cause of an abnormal `state` or `measurement`, and what to do; then the most "
            "significant finding"},
           shown_text(message.reason, most_said));
  see.text({"source", "", "the driver"}, shown_text(message.source, most_said));
  see.choice({"device", "", "`connected`, `no_device` or `failing`"}, message.device);
  see.text_if_any({"device_name", "", "id, serial number and port of a USB device"},
                  shown_text(message.device_name, most_said));
  see.count({"tags", "", "tags from the source since the start"}, message.tags);
  see.count({"lost_tags", "", "lost tags, as far as their number is known"}, message.lost_tags);
  see.count_if_any({"uncounted_losses", "", "number of losses with an unknown number of tags"},
                   message.uncounted_losses);
  see.count({"frames", "", "published frames"}, message.frames);
  see.count({"valid_frames", "", "published frames with a target"}, message.valid_frames);
  see.number({"ring_fill_ratio", "",
              "highest fill of the ring (the buffer of tags) in the last second, 0 to 1"},
             message.ring_fill_ratio);
  see.list_if_any({"findings", "",
                   "[findings](#findings) that at least half of the last second's frames have, and "
                   "findings of many frames together"},
                  message.findings,
                  [](const auto& finding, auto& inner) { describe_finding(finding, inner); });
  see.flag_if_any(
      {"effort_is_lowered", "", "`true` if frames come too fast for the configured effort"},
      message.effort_is_lowered);
  see.part({"pixels", "", "with several pixels: what they detect"}, message.pixels,
           [](const auto& pixels, auto& inner) { describe_pixels(pixels, inner); });
  see.part({"recording", "",
            "the [recording](../guide/recording.md) that splid writes; left out without recording"},
           message.recording,
           [](const auto& recording, auto& inner) { describe_recording(recording, inner); });
}

template <class Visitor>
void describe(const VersionMessage& message, Visitor& see) {
  see.text({"release", "", "version of the program"}, message.release);
  see.text({"pattern", "", "name of the pattern in use"}, message.pattern);
  see.choice({"mode", "", "mode of this pattern"}, message.mode);
}

}  // namespace splid
