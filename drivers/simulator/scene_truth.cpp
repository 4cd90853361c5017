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
#include <string>
#include <system_error>

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

}  // namespace

SceneTruth scene_truth(const Options& options) {
  const double seconds = options.seconds > 0 ? options.seconds : 600;
  const auto length_ps = static_cast<std::int64_t>(std::llround(seconds * ps_per_s));
  SceneTruth truth;
  truth.start_ps = options.start_ps;
  truth.step_ps = std::max(shortest_step_ps, (length_ps + max_steps - 1) / max_steps);
  const std::int64_t steps = (length_ps + truth.step_ps - 1) / truth.step_ps;
  const auto follow = [&](const TargetOptions& path, auto& target) {
    const TargetPath motion(path, options.tagger_rate());
    for (std::int64_t i = 0; i <= steps; ++i) {
      const MotionState state = motion.at(FineTime{i * truth.step_ps, 0}.seconds());
      target.distance_m.push_back(state.distance_m);
      target.velocity_mps.push_back(state.velocity_mps);
    }
  };
  follow(options.target, truth);
  for (const FurtherTarget& target : options.more_targets) {
    truth.more_targets.push_back({target.signal_per_pulse, {}, {}});
    follow(target.path, truth.more_targets.back());
  }
  truth.signal_per_pulse = options.detection.signal_per_pulse;
  truth.background_per_s = options.background_per_s();
  truth.sigma_ps = options.detection.sigma_ps;
  truth.depth_m = options.target.depth_m;
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
