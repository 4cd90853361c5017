#include "drivers/simulator/scene_truth.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "drivers/simulator/array_pixels.hpp"
#include "drivers/simulator/fine_time.hpp"
#include "protocol/error.hpp"

namespace splid::simulator {
namespace {

constexpr std::int64_t max_steps = 600'000;
constexpr std::int64_t shortest_step_ps = 1'000'000'000;

Error cannot_write(const std::string& file, const std::string& reason) {
  return {Fault::device,
          file + ": cannot write the scene's truth: " + reason + "; see source/truth"};
}

// Samples are at least so far apart, and so many in all.
struct Sampling {
  std::int64_t shortest_step_ps;
  std::int64_t max_steps;
};

// Design note: an array's file would have 2 GB an hour with the samples of a single target. 10 ms
// follow a sinusoid of a second to a micrometre.
Sampling sampling_of(std::int64_t pixels) {
  if (pixels == 0) return {shortest_step_ps, max_steps};
  return {10 * shortest_step_ps, std::max<std::int64_t>(1, max_steps / pixels)};
}

std::int64_t ratio_up(std::int64_t dividend, std::int64_t divisor) {
  return (dividend + divisor - 1) / divisor;
}

std::int64_t step_of(const std::optional<Scanner>& scanner, const Sampling& sampling,
                     std::int64_t length_ps) {
  const std::int64_t least_ps = ratio_up(length_ps, sampling.max_steps);
  if (!scanner) return std::max(sampling.shortest_step_ps, least_ps);
  return std::max<std::int64_t>(1, ratio_up(least_ps, scanner->picture_ps())) *
         scanner->picture_ps();
}

class Sampler {
 public:
  Sampler(const Options& options, const SceneTruth& truth, std::int64_t steps)
      : clock_rate_(options.tagger_rate()), step_ps_(truth.step_ps), steps_(steps) {}

  // target: has distance_m and velocity_mps.
  template <class Target>
  void follow(const TargetOptions& path, Target& target, std::int64_t first_ps = 0) const {
    const TargetPath motion(path, clock_rate_);
    for (std::int64_t i = 0; i <= steps_; ++i) {
      const MotionState state = motion.at(FineTime{first_ps + i * step_ps_, 0}.seconds());
      target.distance_m.push_back(state.distance_m);
      target.velocity_mps.push_back(state.velocity_mps);
    }
  }

 private:
  double clock_rate_;
  std::int64_t step_ps_;
  std::int64_t steps_;
};

void add_pixels(const std::vector<ArrayPixel>& pixels, const std::optional<Scanner>& scanner,
                const Sampler& sampler, SceneTruth& truth) {
  for (const ArrayPixel& pixel : pixels) {
    SceneTruth::Pixel& other = truth.pixels.emplace_back();
    other.input = pixel.scene.photon_input;
    other.azimuth_deg = pixel.direction.azimuth_deg;
    other.elevation_deg = pixel.direction.elevation_deg;
    other.delay_ps = pixel.delay_ps;
    other.signal_per_pulse = pixel.scene.detection.signal_per_pulse;
    other.background_per_s = pixel.scene.background_per_s();
    if (scanner) other.first_ps = scanner->first_middle_ps(truth.pixels.size() - 1);
    sampler.follow(pixel.scene.target, other, other.first_ps);
  }
}

}  // namespace

SceneTruth scene_truth(const Options& options) {
  std::vector<ArrayPixel> pixels;
  if (options.array.used()) pixels = array_pixels(options);
  const Options& scene = pixels.empty() ? options : pixels.front().scene;
  const double seconds = options.seconds > 0 ? options.seconds : 600;
  const auto length_ps = static_cast<std::int64_t>(std::llround(seconds * ps_per_s));
  const Sampling sampling = sampling_of(static_cast<std::int64_t>(pixels.size()));
  const std::optional<Scanner> scanner = options.scanner_in_use();
  SceneTruth truth;
  truth.start_ps = options.start_ps;
  truth.step_ps = step_of(scanner, sampling, length_ps);
  const Sampler sampler(options, truth, ratio_up(length_ps, truth.step_ps));
  sampler.follow(scene.target, truth, scanner ? scanner->first_middle_ps(0) : 0);
  for (const FurtherTarget& target : options.more_targets) {
    truth.more_targets.push_back({target.signal_per_pulse, {}, {}});
    sampler.follow(target.path, truth.more_targets.back());
  }
  add_pixels(pixels, scanner, sampler, truth);
  if (!pixels.empty()) {
    truth.crosstalk_probability = options.array.crosstalk_probability;
    truth.crosstalk_ns = options.array.crosstalk_ns;
    truth.dwell_ps = scanner ? scanner->dwell_ps() : 0;
  }
  truth.signal_per_pulse = scene.detection.signal_per_pulse;
  truth.background_per_s = scene.background_per_s();
  truth.sigma_ps = options.detection.sigma_ps;
  truth.depth_m = scene.target.depth_m;
  truth.electronic_delay_ns = options.detection.electronic_delay_ns;
  truth.drift_ppm = options.drift_ppm;
  truth.drift_ramp_ppm_per_s = options.drift_ramp_ppm_per_s;
  return truth;
}

void write_truth_file(const Options& options) {
  const std::string temporary = options.truth + "." + std::to_string(::getpid()) + ".part";
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out << to_json(scene_truth(options)) << '\n';
    out.close();
    if (!out) {
      const std::string reason = std::strerror(errno);
      std::remove(temporary.c_str());
      throw cannot_write(options.truth, reason);
    }
  }
  std::error_code failure;
  std::filesystem::rename(temporary, options.truth, failure);
  if (!failure) return;
  std::remove(temporary.c_str());
  throw cannot_write(options.truth, failure.message());
}

}  // namespace splid::simulator
