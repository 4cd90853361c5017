// Prints the table docs/evidence/data/calibration.csv: how far off distances are where a gaussian
// stands for a pulse with a tail, and where the shape stands that `splid calibrate` finds. The
// pulse times are the calibrated ones in both cases.
//
//   calibration_bias [FRAMES]    400 frames for each row by default, which takes about a minute

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "daemon/study/calibration/pattern_calibration.hpp"
#include "daemon/study/tradeoff/tradeoff_frames.hpp"
#include "drivers/simulator/simulator.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "protocol/pattern_make.hpp"

namespace splid {
namespace {

constexpr double mm_per_ns = speed_of_light_mps * 1e-9 / 2 * 1e3;
constexpr double target_m = 30;

struct Row {
  double tail_fraction;
  double tail_ps;
  double ambient_per_s;
};

struct Errors {
  double bias_mm = 0;
  double std_bias_mm = 0;
  double spread_mm = 0;     // rms about the bias
  double published_mm = 0;  // mean published deviation
  double signal = 0;        // mean estimate over the truth
};

Config config_of_scene() {
  Config config;
  config.pattern_file = "interleaved";
  const std::vector<double> subperiods_ps{180'000, 189'000};
  config.pattern = make_interleaved(subperiods_ps);
  config.pipeline.ring_capacity_tags = 1 << 20;
  return config;
}

simulator::Options scene_of(const Row& row) {
  simulator::Options scene;
  scene.pace = simulator::Speed::max;
  scene.target.motion = simulator::MotionKind::linear;
  scene.target.distance_m = target_m;
  scene.detection.tail_fraction = row.tail_fraction;
  scene.detection.tail_ps = row.tail_ps;
  scene.ambient_per_s = row.ambient_per_s;
  return scene;
}

// A recording of one second, with 1.06 million signal photons.
Pattern calibrated(const Row& row) {
  const Config config = config_of_scene();
  simulator::Options scene = scene_of(row);
  scene.detection.signal_per_pulse = 0.1;
  scene.seconds = 1;
  scene.seed = 1000;
  calibration::Plan plan;
  plan.recording = "a simulated recording";
  plan.distance_m = target_m;
  const auto open = [&] { return std::make_unique<simulator::Source>(scene, config.pattern); };
  return calibration::calibrate_pattern(config, open, plan, [](const char*, double) {}, {}).pattern;
}

Errors measure(const std::vector<tradeoff::KeptFrame>& frames, const Pattern& pattern,
               Shape shape) {
  PulseOptions pulse;
  pulse.shape = shape;
  FrameEstimator estimator(pattern, pulse, {}, {}, 50, 100'000);
  const double signal_per_pulse = simulator::DetectionOptions{}.signal_per_pulse;
  Errors errors;
  const auto count = static_cast<double>(frames.size());
  double squares = 0;
  for (const tradeoff::KeptFrame& frame : frames) {
    const Estimate estimate = estimator.estimate(frame.view());
    const double error_mm = (estimate.delay_ns - frame.truth->delay_ns) * mm_per_ns;
    errors.bias_mm += error_mm / count;
    squares += error_mm * error_mm / count;
    errors.published_mm += estimate.std_delay_ns * mm_per_ns / count;
    errors.signal += estimate.signal_per_pulse / signal_per_pulse / count;
  }
  errors.spread_mm = std::sqrt(squares - errors.bias_mm * errors.bias_mm);
  errors.std_bias_mm = errors.spread_mm / std::sqrt(count);
  return errors;
}

void print(const Errors& errors) {
  std::printf(" %+.3f +- %.3f | %.3f | %.2f | %.3f |", errors.bias_mm, errors.std_bias_mm,
              errors.spread_mm, errors.spread_mm / errors.published_mm, errors.signal);
}

void run(const Row& row, std::size_t frames) {
  const Pattern pattern = calibrated(row);
  const tradeoff::FrameOrigin origin{"scene", scene_of(row), {}, std::nullopt, {}};
  const auto kept =
      tradeoff::collect_frames(config_of_scene(), origin, 50, frames, [](std::size_t) {}, {});
  std::printf("| %g %%, %g ps | %g |", 100 * row.tail_fraction, row.tail_ps,
              row.ambient_per_s * 1e-9);
  print(measure(kept, pattern, Shape::gaussian));
  print(measure(kept, pattern, Shape::tabulated));
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  const std::size_t frames = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 400;
  std::printf(
      "| tail | background, /ns | gaussian: bias, mm | spread, mm | over published | signal "
      "| calibrated: bias, mm | spread, mm | over published | signal |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  for (const splid::Row row : {splid::Row{0, 0, 174'500}, splid::Row{0.2, 150, 174'500},
                               splid::Row{0.3, 300, 174'500}, splid::Row{0.5, 300, 174'500},
                               splid::Row{0.3, 300, 10'000}, splid::Row{0.3, 1000, 174'500}}) {
    splid::run(row, frames);
  }
  return 0;
}
