#pragma once

#include <cstdint>
#include <vector>

#include "drivers/simulator/array_pixels.hpp"
#include "drivers/simulator/random.hpp"
#include "drivers/simulator/scene.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "drivers/tag_writer.hpp"
#include "protocol/pattern.hpp"
#include "protocol/tag.hpp"

namespace splid::simulator {

// A detection in an array makes another in a pixel beside, above or below. It is one like any
// other: it may make a third, it is lost where the detector is dead, and it makes the detector
// dead.
//
// Threads: one. No allocation once the fullest stretch has passed.
class Crosstalk {
 public:
  explicit Crosstalk(const Options& options);

  // Puts the crosstalk before until_ps (in the tagger's clock) among the photons, which are sorted
  // by their times in the detectors, and takes those out that a dead detector misses.
  void add(std::vector<Tag>& photons, std::int64_t until_ps);
  [[nodiscard]] bool any() const { return probability_ > 0; }

 private:
  void take(const Tag& photon);
  [[nodiscard]] int neighbour(int pixel, double chance) const;

  double probability_;
  double mean_ps_;
  std::int64_t dead_time_ps_;
  int first_input_;
  int columns_;
  int rows_;
  Random random_;
  std::vector<std::int64_t> dead_until_ps_;  // of each pixel
  std::vector<Tag> waiting_;                 // crosstalk to come: a heap, the earliest first
  std::vector<Tag> taken_;
};

// The events that a tagger records of an array. As Scene, but that events of one picosecond are in
// the order of their inputs.
class ArrayScene {
 public:
  // Errors: as array_pixels().
  ArrayScene(const Pattern& pattern, const Options& options);

  bool write_until(std::int64_t until_ps, TagWriter& out);

 private:
  void collect(std::int64_t until_ps);
  bool put(const Tag& tag, TagWriter& out);

  std::vector<Scene> pixels_;
  std::vector<std::int64_t> delays_ps_;  // of each pixel's cable
  Scene clock_;                          // syncs and markers
  std::int32_t first_input_;
  std::int64_t start_ps_;
  bool near_photons_only_;
  bool photon_since_sync_ = false;
  Crosstalk crosstalk_;
  std::vector<Tag> photons_;  // of one stretch, in the detectors' time
  std::vector<Tag> tags_;     // with the cables' delays: to be written, in the order of time
};

}  // namespace splid::simulator
