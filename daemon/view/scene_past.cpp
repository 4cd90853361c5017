#include "daemon/view/scene_past.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "protocol/frame_columns.hpp"

namespace splid::view {
namespace {

constexpr std::array<std::optional<double> FrameMessage::*, 9> kept_members{
    &FrameMessage::distance_m,       &FrameMessage::std_distance_m,
    &FrameMessage::velocity_mps,     &FrameMessage::std_velocity_mps,
    &FrameMessage::signal_per_pulse, &FrameMessage::std_signal_per_pulse,
    &FrameMessage::background_per_s, &FrameMessage::std_background_per_s,
    &FrameMessage::significance};

}  // namespace

std::size_t ScenePast::most_kept() const {
  const std::size_t bytes = sizeof(Scene) + names_.size() * sizeof(Values);
  return std::min(most_scenes, most_bytes / bytes);
}

void ScenePast::add(const SceneMessage& scene, std::int64_t came_ns) {
  const bool is_same = std::equal(
      scene.pixels.begin(), scene.pixels.end(), names_.begin(), names_.end(),
      [](const SceneMessage::Pixel& pixel, const auto& name) { return pixel.name == name; });
  if (!is_same ||
      (!scenes_.empty() && scene.whole.timestamp_s < scenes_.back().whole.timestamp_s - 1)) {
    forget();
    for (const SceneMessage::Pixel& pixel : scene.pixels) names_.push_back(pixel.name);
  }
  Scene& last = scenes_.emplace_back(Scene{scene.whole, came_ns, {}});
  last.pixels.reserve(names_.size());
  for (const SceneMessage::Pixel& pixel : scene.pixels) {
    Values& values = last.pixels.emplace_back(Values{{}, pixel.frame.status});
    for (std::size_t i = 0; i < kept_members.size(); ++i) {
      values.numbers[i] =
          (pixel.frame.*kept_members[i]).value_or(std::numeric_limits<double>::quiet_NaN());
    }
  }
  if (scenes_.size() <= most_kept()) return;
  scenes_.pop_front();
  is_cut_ = true;
}

void ScenePast::forget() {
  scenes_.clear();
  names_.clear();
  is_cut_ = false;
}

std::optional<std::size_t> ScenePast::index_of(const std::string& pixel) const {
  const auto found = std::find(names_.begin(), names_.end(), pixel);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

FrameMessage ScenePast::frame_of(const Scene& scene, std::size_t index, const std::string& name) {
  FrameMessage frame = scene.whole;
  const Values& values = scene.pixels[index];
  frame.pixel = name;
  frame.status = values.status;
  for (std::size_t i = 0; i < kept_members.size(); ++i) {
    if (!std::isnan(values.numbers[i])) frame.*kept_members[i] = values.numbers[i];
  }
  return frame;
}

void ScenePast::tell(const std::string& pixel, const Hear& hear) const {
  const auto index = index_of(pixel);
  if (!index) return;
  for (const Scene& scene : scenes_) hear(frame_of(scene, *index, pixel), scene.came_ns);
}

std::optional<FrameMessage> ScenePast::last_of(const std::string& pixel) const {
  const auto index = index_of(pixel);
  if (!index || scenes_.empty()) return std::nullopt;
  return frame_of(scenes_.back(), *index, pixel);
}

std::optional<std::string> ScenePast::csv(const std::string& pixel, double from_s,
                                          double to_s) const {
  if (is_cut_ && !(from_s >= scenes_.front().whole.timestamp_s)) return std::nullopt;
  std::string text = frame_csv_head();
  tell(pixel, [&](const FrameMessage& frame, std::int64_t /*came_ns*/) {
    if (frame.timestamp_s >= from_s && frame.timestamp_s <= to_s) text += frame_csv_row(frame);
  });
  return text;
}

}  // namespace splid::view
