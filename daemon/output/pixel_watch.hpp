#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/scene_json.hpp"
#include "protocol/status_json.hpp"

namespace splid {

// Tells which of several pixels count nothing, and which never stop, over the frames of a second.
//
// Threads: one. Errors: none.
class PixelWatch {
 public:
  // A pixel that counts this many times the median of those that count is hot.
  static constexpr std::uint64_t hot_ratio = 20;

  // A scene of the same pixels as the scene before.
  void add(const SceneMessage& scene);
  [[nodiscard]] const PixelsStatus& seen() const { return seen_; }

 private:
  struct Pixel {
    std::uint64_t photons = 0;
    bool overflows = false;  // more came than there is room for
  };
  void judge(const SceneMessage& scene);

  PixelsStatus seen_;
  std::vector<Pixel> now_;  // of the second that runs
  double lasted_ms_ = 0;
};

// A sentence that names the pixels that are dark or hot, with what to do; empty where none is.
std::string in_words(const PixelsStatus& pixels);

}  // namespace splid
