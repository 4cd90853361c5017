#include "drivers/simulator/array_pixels.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace splid::simulator {
namespace {

double start_m(const TargetOptions& path, double clock_rate) {
  return TargetPath(path, clock_rate).at(0).distance_m;
}

// The nearest surface in a direction.
class Surfaces {
 public:
  explicit Surfaces(const Options& options)
      : planes_(options.array.planes),
        picture_(options.array.picture),
        room_(options.array.room),
        clock_rate_(options.tagger_rate()) {}

  [[nodiscard]] std::optional<Meeting> nearest(const Direction& direction) const {
    std::optional<Meeting> nearest = picture_.meet(direction);
    for (const Plane& plane : planes_) take_nearer(plane.meet(direction), nearest);
    take_nearer(meet(room_, direction), nearest);
    return nearest;
  }

 private:
  void take_nearer(std::optional<Meeting> met, std::optional<Meeting>& nearest) const {
    if (!met) return;
    if (nearest && start_m(nearest->path, clock_rate_) <= start_m(met->path, clock_rate_)) return;
    nearest = std::move(met);
  }

  std::vector<Plane> planes_;
  PictureSurface picture_;
  RoomOptions room_;
  double clock_rate_;
};

// A pixel that no detector of the list describes, in the middle of its place in the grid.
// scene: without its array.
ArrayPixel plain_pixel(const Options& scene, const ArrayOptions& array, std::int64_t index) {
  const auto column = static_cast<double>(index % array.columns);
  const std::int64_t rows_above = index / array.columns;
  const auto row = static_cast<double>(rows_above);
  ArrayPixel pixel;
  pixel.direction = {array.pitch_deg * (column - static_cast<double>(array.columns - 1) / 2),
                     array.pitch_deg * (static_cast<double>(array.rows - 1) / 2 - row)};
  pixel.scene = scene;
  pixel.scene.photon_input = scene.photon_input + index;
  // A splitmix constant keeps the pixels of one seed apart. The mask keeps the lowest bit, by which
  // neighbouring seeds differ.
  const std::uint64_t seed = static_cast<std::uint64_t>(scene.seed) +
                             static_cast<std::uint64_t>(index) * 0x9e37'79b9'7f4a'7c15U;
  pixel.scene.seed = static_cast<std::int64_t>(seed & std::numeric_limits<std::int64_t>::max());
  return pixel;
}

void set_own(ArrayPixel& pixel, const ArrayInput& input) {
  pixel.direction.azimuth_deg = input.azimuth_deg.value_or(pixel.direction.azimuth_deg);
  pixel.direction.elevation_deg = input.elevation_deg.value_or(pixel.direction.elevation_deg);
  pixel.delay_ps = input.delay_ps;
  pixel.scene.dark_per_s = input.dark_per_s.value_or(pixel.scene.dark_per_s);
}

void look(ArrayPixel& pixel, const Surfaces& surfaces, const ArrayInput* input) {
  DetectionOptions& light = pixel.scene.detection;
  if (input != nullptr && input->distance_m) {
    pixel.scene.target = {};
    pixel.scene.target.motion = MotionKind::linear;
    pixel.scene.target.distance_m = *input->distance_m;
    pixel.scene.target.velocity_mps = input->velocity_mps;
  } else if (std::optional<Meeting> met = surfaces.nearest(pixel.direction)) {
    pixel.scene.target = std::move(met->path);
    light.signal_per_pulse = met->signal_per_pulse;
  } else {
    light.signal_per_pulse = 0;
  }
  if (input != nullptr) {
    light.signal_per_pulse = input->signal_per_pulse.value_or(light.signal_per_pulse);
  }
}

}  // namespace

std::vector<ArrayPixel> array_pixels(const Options& options) {
  const ArrayOptions& array = options.array;
  const Surfaces surfaces(options);
  const std::int64_t count = array.columns * array.rows;
  const bool one_detector = options.scanner.used();
  std::vector<const ArrayInput*> own(static_cast<std::size_t>(count), nullptr);
  for (const ArrayInput& input : array.inputs) {
    own[static_cast<std::size_t>(input.input - options.photon_input)] = &input;
  }
  Options scene = options;
  scene.array = {};
  scene.scanner = {};
  std::vector<ArrayPixel> pixels;
  pixels.reserve(own.size());
  for (std::int64_t index = 0; index < count; ++index) {
    ArrayPixel& pixel = pixels.emplace_back(plain_pixel(scene, array, index));
    const ArrayInput* input = own[static_cast<std::size_t>(index)];
    if (one_detector) pixel.scene.photon_input = options.photon_input;
    if (input != nullptr) set_own(pixel, *input);
    look(pixel, surfaces, input);
  }
  return pixels;
}

}  // namespace splid::simulator
