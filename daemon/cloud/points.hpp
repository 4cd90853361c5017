#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "config/config.hpp"
#include "daemon/cloud/point.hpp"
#include "protocol/frame_json.hpp"

namespace splid::cloud {

// Makes points of the frames of pixels. A frame that is not valid makes none and is counted; one
// that lists several targets makes a point of each that is valid.
//
// Threads: one. Errors: Error(Fault::usage) from the constructor where neither the scan nor a
// pixel has a direction, and from add() where only the frames tell that these are a scan.
class Points {
 public:
  explicit Points(const Config& config);

  using Take = std::function<void(const Point&)>;
  // A frame of a pixel of that configuration.
  void add(const FrameMessage& frame, const Take& take);

  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  [[nodiscard]] std::uint64_t ambiguous() const { return ambiguous_; }  // points of such a range
  // Valid frames of a scan that have no direction, as the angles of the scanner do not reach there.
  [[nodiscard]] std::uint64_t without_direction() const { return without_direction_; }
  // The frames without a point, by their status: "12 no_target, 3 incomplete"; empty: none.
  [[nodiscard]] std::string left_out() const;

 private:
  struct Direction {
    double ahead, left, up;
  };

  static Direction direction_of(double azimuth_deg, double elevation_deg);
  // Where the frame's light comes from; absent where nothing tells it.
  [[nodiscard]] std::optional<Direction> direction_of(const FrameMessage& frame,
                                                      std::size_t place) const;

  std::string config_file_;
  bool is_scan_;                                         // each frame has a direction of its own
  std::vector<Direction> directions_;                    // of the pixels
  std::unordered_map<std::string, std::size_t> places_;  // of the pixels, by their names
  std::uint64_t frames_ = 0;
  std::uint64_t ambiguous_ = 0;
  std::uint64_t without_direction_ = 0;
  std::array<std::uint64_t, frame_status_names.size()> left_out_{};
};

}  // namespace splid::cloud
