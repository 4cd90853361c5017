#pragma once

#include <vector>

#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/lane.hpp"
#include "protocol/scene_json.hpp"

namespace splid {

// What a message `scene` holds of the frames of several pixels.
//
// Threads: one. Errors: none.
class SceneMaker {
 public:
  // The configuration has several pixels.
  explicit SceneMaker(const Config& config);

  // The source counts syncs and does not time them (SourceInfo).
  void set_syncs_are_counted(bool are_counted);
  // unit: of several pixels. The result is valid until the next call.
  SceneMessage& make(const EstimationUnit& unit, double latency_ms);

 private:
  void sum_up(const EstimationUnit& unit, double latency_ms);

  FrameContext shared_;
  std::vector<FrameContext> contexts_;  // of each pixel
  SceneMessage scene_;
};

}  // namespace splid
