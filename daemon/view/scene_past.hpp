#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocol/scene_json.hpp"

namespace splid::view {

// The last scenes in little room, so that each pixel has a past as soon as somebody looks at it.
//
// Threads: one. Errors: none.
class ScenePast {
 public:
  // Of 1,024 pixels the last 40 s at 20 scenes a second, of 256 the last 2.5 minutes.
  static constexpr std::size_t most_bytes = 64U << 20U;
  // A quarter of an hour and more at 20 scenes a second.
  static constexpr std::size_t most_scenes = 20'000;

  // came_ns: on the clock of this machine. Other pixels than before begin the past anew, and so
  // does a scene more than a second before the last, as another replay does.
  void add(const SceneMessage& scene, std::int64_t came_ns);
  void forget();

  [[nodiscard]] bool empty() const { return scenes_.empty(); }
  [[nodiscard]] std::size_t size() const { return scenes_.size(); }

  // Hears the frames of a pixel in the order in which they came, with the members that a scene has.
  using Hear = std::function<void(const FrameMessage&, std::int64_t came_ns)>;
  void tell(const std::string& pixel, const Hear& hear) const;

  // A pixel's frame in the last scene; absent for a name that it has not.
  [[nodiscard]] std::optional<FrameMessage> last_of(const std::string& pixel) const;

  // A pixel's frames from `from_s` to `to_s`, as FrameTable::csv() has them.
  [[nodiscard]] std::optional<std::string> csv(const std::string& pixel, double from_s,
                                               double to_s) const;

 private:
  // The numbers of a pixel, NaN where it has none; scene_past.cpp says which.
  struct Values {
    std::array<double, 9> numbers;
    FrameStatus status;
  };
  struct Scene {
    FrameMessage whole;
    std::int64_t came_ns;
    std::vector<Values> pixels;
  };
  [[nodiscard]] std::size_t most_kept() const;
  [[nodiscard]] std::optional<std::size_t> index_of(const std::string& pixel) const;
  static FrameMessage frame_of(const Scene& scene, std::size_t index, const std::string& name);

  std::vector<std::string> names_;
  std::deque<Scene> scenes_;
  bool is_cut_ = false;  // scenes before the first are gone
};

}  // namespace splid::view
