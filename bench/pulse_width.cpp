// What a pulse costs that is not the configured one, how often it is noticed, and what it costs to
// fit its width: the table docs/evidence/data/pulse-width.csv.
//
//   pulse_width [TRIALS [NAME]]     by default 1000 frames for each row; rows whose scene has NAME.
//                                   Those of bright pulses before a blind detector, which take a
//                                   third of a second a frame, only where it is asked for

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "bench/thread_clock.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/likelihood/bound.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double mm_per_ns_of_delay = 299.792458 / 2;
constexpr double experiment_signal = 13.5e-4;

// A target whose pulse is not the configured one, of 0.1 ns.
struct Scene {
  const char* name;
  double sigma_ns = 0.1;
  double behind_mm = 0;     // a second surface so far behind
  double light_behind = 0;  // its light, relative to the first
  double signal = experiment_signal;
  double length_ms = 50;
  double dead_time_ns = 0;
  double late_share = 0, late_ns = 0;  // of the light, late by a time of which this is the mean
};

// A value's errors and its published deviations.
struct Errors {
  double sum = 0, squares = 0, squared_std = 0;
  int within = 0, count = 0;
  void add(double error, double deviation) {
    sum += error;
    squares += error * error;
    squared_std += deviation * deviation;
    within += std::abs(error) <= deviation ? 1 : 0;
    ++count;
  }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double rmse() const { return std::sqrt(squares / count); }
  [[nodiscard]] double published() const { return std::sqrt(squared_std / count); }
  [[nodiscard]] double share_within() const { return 100.0 * within / count; }
};

struct Tally {
  Errors distance_mm, velocity_mps, signal;
  double width = 0;  // published widths, or those of the findings
  int valid = 0, with_width = 0, with_findings = 0, with_recent = 0;
  std::vector<double> took_ms;
};

void add(const Estimate& e, const test::FrameMaker& made, double signal, Tally& tally) {
  if (!e.has_values) return;
  ++tally.valid;
  tally.with_findings += e.findings.all().empty() ? 0 : 1;
  tally.with_recent += e.recent_findings.all().empty() ? 0 : 1;
  const double delay_ns = 2 * made.distance_m / 0.299792458;
  tally.distance_mm.add(mm_per_ns_of_delay * std::remainder(e.delay_ns - delay_ns, 3780.0),
                        mm_per_ns_of_delay * e.std_delay_ns);
  tally.velocity_mps.add(e.velocity_mps - made.velocity_mps, e.std_velocity_mps);
  tally.signal.add(e.signal_per_pulse / signal - 1, e.std_signal_per_pulse / signal);
  const bool is_fitted = e.std_pulse_sigma_ns > 0;
  if (is_fitted) {
    ++tally.with_width;
    tally.width += e.pulse_sigma_ns * 1e3;
  }
  for (const Finding& finding : e.findings.all()) {
    if (is_fitted || finding.name != FindingName::pulse_width) continue;
    ++tally.with_width;
    tally.width += 100 * (1 + finding.value);
  }
}

double bound_mm(const Scene& scene, const test::FrameMaker& made, bool is_fitted) {
  if (scene.light_behind > 0 || scene.late_share > 0) return 0;
  BoundScene at = {made.length_ms * 1e6,
                   made.length_ms * 1e6,
                   2 * made.distance_m / 0.299792458,
                   made.velocity_mps,
                   made.signal_per_pulse,
                   made.background_per_ns,
                   true,
                   false};
  at.width_unknown = is_fitted;
  at.detector = {scene.dead_time_ns, 1};
  const auto shape = make_gaussian(scene.sigma_ns);
  return mm_per_ns_of_delay * cramer_rao_bound(made.pattern, *shape, at).delay_ns;
}

void run(const Scene& scene, PulseWidth width, int trials) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = scene.length_ms;
  made.sigma_ns = scene.sigma_ns;
  made.signal_per_pulse = scene.signal;
  made.dead_time_ns = scene.dead_time_ns;
  made.late_share = scene.late_share;
  made.late_ns = scene.late_ns;
  PulseOptions pulse;
  pulse.width = width;
  FrameEstimator estimator(made.pattern, pulse, {}, {}, made.length_ms, 700'000,
                           ClockReference::tagger, {scene.dead_time_ns});
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> velocity(-100, 100), distance(284, 285);
  Tally tally;
  for (int n = 0; n < trials; ++n) {
    made.velocity_mps = velocity(random);
    made.distance_m = distance(random);
    test::FrameMaker behind = made;
    behind.distance_m += scene.behind_mm * 1e-3;
    behind.signal_per_pulse *= scene.light_behind;
    const auto frame = scene.light_behind > 0
                           ? made.make_with({behind}, static_cast<std::uint64_t>(n))
                           : made.make(static_cast<std::uint64_t>(n));
    const double begin_ms = bench::thread_ms();
    const Estimate e = estimator.estimate(frame.view());
    tally.took_ms.push_back(bench::thread_ms() - begin_ms);
    add(e, made, scene.signal * (1 + scene.light_behind), tally);
  }
  const auto middle = tally.took_ms.begin() + trials / 2;
  std::nth_element(tally.took_ms.begin(), middle, tally.took_ms.end());
  std::printf("| %s | %s | %.1f %% | %.1f %% | ", scene.name,
              width == PulseWidth::fitted ? "fitted" : "fixed", 100.0 * tally.valid / trials,
              100.0 * tally.with_width / trials);
  std::printf("%.1f %% | %.1f %% | ", 100.0 * tally.with_findings / trials,
              100.0 * tally.with_recent / trials);
  if (tally.with_width > 0) std::printf("%.0f", tally.width / tally.with_width);
  std::printf(" | ");
  const double bound = bound_mm(scene, made, width == PulseWidth::fitted);
  if (bound > 0) std::printf("%.2f", bound);
  if (tally.valid == 0) tally.distance_mm.count = tally.velocity_mps.count = tally.signal.count = 1;
  std::printf(
      " | %+.2f | %.2f | %.2f | %.0f %% | %.3f | %.3f | %.0f %% | %+.1f %% | %.0f %% | "
      "%.2f |\n",
      tally.distance_mm.mean(), tally.distance_mm.rmse(), tally.distance_mm.published(),
      tally.distance_mm.share_within(), tally.velocity_mps.rmse(), tally.velocity_mps.published(),
      tally.velocity_mps.share_within(), 100 * tally.signal.mean(), tally.signal.share_within(),
      *middle);
  std::fflush(stdout);
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 1000;
  const std::string name = argc > 2 ? argv[2] : "";
  constexpr double s = splid::experiment_signal;
  const std::vector<splid::Scene> scenes = {
      {"as configured", 0.1},
      {"as configured, S / 7", 0.1, 0, 0, s / 7},
      {"as configured, S x 10", 0.1, 0, 0, s * 10},
      {"as configured, 5 ms, S = 0.5, dead time 50 ns", 0.1, 0, 0, 0.5, 5, 50},
      {"0.6 x as wide", 0.06},
      {"1.2 x as wide", 0.12},
      {"1.5 x as wide", 0.15},
      {"2 x as wide", 0.2},
      {"2 x as wide, S / 7", 0.2, 0, 0, s / 7},
      {"3 x as wide", 0.3},
      {"1:2 1 cm behind", 0.1, 10, 0.5},
      {"1:2 2 cm behind", 0.1, 20, 0.5},
      {"1:2 3 cm behind", 0.1, 30, 0.5},
      {"1:2 6 cm behind", 0.1, 60, 0.5},
      {"1:2 12 cm behind", 0.1, 120, 0.5},
      {"1:10 3 cm behind", 0.1, 30, 0.1},
      {"1:2 4 cm behind", 0.1, 40, 0.5},
      {"1:1 6 cm behind", 0.1, 60, 1},
      {"30 % late by 0.2 ns", 0.1, 0, 0, s, 50, 0, 0.3, 0.2},
      {"30 % late by 0.2 ns, S / 3", 0.1, 0, 0, s / 3, 50, 0, 0.3, 0.2},
      {"10 % late by 0.2 ns", 0.1, 0, 0, s, 50, 0, 0.1, 0.2},
      {"30 % late by 1 ns", 0.1, 0, 0, s, 50, 0, 0.3, 1},
      {"blind for 50 ns, S = 3, as configured", 0.1, 0, 0, 3, 50, 50},
      {"blind for 50 ns, S = 3, 1.003 x as wide", 0.1003, 0, 0, 3, 50, 50},
      {"blind for 50 ns, S = 3, 1.006 x as wide", 0.1006, 0, 0, 3, 50, 50},
      {"blind for 50 ns, S = 3, 1.01 x as wide", 0.101, 0, 0, 3, 50, 50},
      {"blind for 50 ns, S = 3, 1.02 x as wide", 0.102, 0, 0, 3, 50, 50},
      {"blind for 50 ns, S = 3, 0.99 x as wide", 0.099, 0, 0, 3, 50, 50},
      {"blind for 50 ns, S = 1, 1.01 x as wide", 0.101, 0, 0, 1, 50, 50},
  };
  std::printf(
      "| scene | width | valid | with a width | findings | recent findings | width, ps | bound, mm "
      "| distance off "
      "by, mm | rms, "
      "mm | published, mm | within | velocity rms, m/s | published, m/s | within | signal off by | "
      "within | p50, ms |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const splid::Scene& scene : scenes) {
    if (std::string(scene.name).find(name) == std::string::npos) continue;
    if (scene.signal >= 1 && name.empty()) continue;
    splid::run(scene, splid::PulseWidth::fixed, trials);
    // A fitted width knows no dead time: such frames are saturated.
    if (scene.dead_time_ns == 0) splid::run(scene, splid::PulseWidth::fitted, trials);
  }
}
