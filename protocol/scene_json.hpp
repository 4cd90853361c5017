#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"

// The `scene` message: one frame of an instrument with several pixels, and its JSON
// (docs/reference/messages.md). daemon/stream/scene_message.hpp fills it.

namespace splid {

struct SceneMessage {
  struct Pixel {
    std::string name;
    std::optional<double> azimuth_deg, elevation_deg;
    FrameMessage frame;  // as it would be published for this pixel alone
  };
  // What the pixels share: times, losses and syncs. Its status is `ok` where a pixel's is, else the
  // commonest; it has no distance and no velocity.
  FrameMessage whole;
  std::vector<Pixel> pixels;  // in the order of the configuration
};

inline constexpr const char* topic_scene = "scene";

// The topic of one pixel's frames.
std::string pixel_topic(const std::string& name);

// One line of JSON without a line feed, its numbers as in a frame's. A value of each pixel stands
// in an array, where null stands for a value that is not known. Directions are left out where no
// pixel has one.
std::string to_json(const SceneMessage& scene);

// The members that a scene has in its JSON; the others of the pixels' frames are absent.
// Errors: Error(Fault::data) naming the member that is missing or of the wrong type.
SceneMessage scene_from_json(const std::string& json);

}  // namespace splid
