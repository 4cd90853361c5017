// The time that the estimator alone takes for a frame, on [P]'s experiment and on scenes beside it.
// The scenes come from the physics in tests/support, and seeds differ from frame to frame.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "bench/thread_clock.hpp"
#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

// Reports the median and the 99th percentile of the thread's own time for a frame, beside the mean.
void estimate(benchmark::State& state, const test::FrameMaker& made,
              const EstimatorOptions& options = {}, const SceneOptions& scene = {},
              const DetectorOptions& detector = {}) {
  // So many frames show the spread, and are made in a second.
  const double expected = made.background_per_ns * made.length_ms * 1e6;
  const int frames_made = expected < 2e5 ? 64 : 4;
  std::vector<test::FrameMaker::Frame> frames;
  double photons = 0;
  std::size_t most = 0;
  for (int n = 0; n < frames_made; ++n) {
    frames.push_back(made.make(static_cast<std::uint64_t>(n)));
    photons += static_cast<double>(frames.back().photons_ps.size()) / frames_made;
    most = std::max(most, frames.back().photons_ps.size());
  }
  FrameEstimator estimator(made.pattern, {}, scene, options, made.length_ms, most,
                           ClockReference::tagger, detector);
  estimator.estimate(frames.front().view());
  std::vector<double> times_ms;
  TargetTrack track;
  std::size_t next = 0;
  double found = 0;
  for (auto _ : state) {
    const double begin = bench::thread_ms();
    const FrameView view = frames[next++ % frames.size()].view();
    const Estimate e = estimator.estimate(view, options.tracked ? &track : nullptr);
    times_ms.push_back(bench::thread_ms() - begin);
    found += e.has_values ? 1 : 0;
  }
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["p50_ms"] = times_ms[times_ms.size() / 2];
  state.counters["p99_ms"] = times_ms[times_ms.size() * 99 / 100];
  state.counters["photons"] = photons;
  state.counters["found"] = found / static_cast<double>(times_ms.size());
}

test::FrameMaker experiment(bool random) {
  test::FrameMaker made;
  made.pattern = random ? test::random_pattern(3780000, 40, 9000, 5)
                        : test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = random ? -140 : 10;
  return made;
}

void interleaved(benchmark::State& state) { estimate(state, experiment(false)); }
BENCHMARK(interleaved)->Unit(benchmark::kMillisecond);

void random(benchmark::State& state) { estimate(state, experiment(true)); }
BENCHMARK(random)->Unit(benchmark::kMillisecond);

// What a scene does not need.

void followed(benchmark::State& state) {
  test::FrameMaker made = experiment(false);
  made.velocity_mps = 0;  // all frames are the same instant's
  estimate(state, made, {.tracked = true});
}
BENCHMARK(followed)->Unit(benchmark::kMillisecond);

void at_rest(benchmark::State& state) {
  test::FrameMaker made = experiment(false);
  made.velocity_mps = 0;
  estimate(state, made, {}, {.motion = Motion::static_target});
}
BENCHMARK(at_rest)->Unit(benchmark::kMillisecond);

void slow(benchmark::State& state) {
  estimate(state, experiment(false), {}, {.max_speed_mps = 15});
}
BENCHMARK(slow)->Unit(benchmark::kMillisecond);

void without_background(benchmark::State& state) {
  test::FrameMaker made = experiment(false);
  made.background_per_ns = 0;
  estimate(state, made);
}
BENCHMARK(without_background)->Unit(benchmark::kMillisecond);

// What it costs to model a dead time: frames of a detector that is blind for 50 ns.
void dead_time_modelled(benchmark::State& state) {
  test::FrameMaker made = experiment(false);
  made.dead_time_ns = 50;
  estimate(state, made, {}, {}, {.dead_time_ns = 50 * double(state.range(0))});
}
BENCHMARK(dead_time_modelled)->ArgName("known")->DenseRange(0, 1)->Unit(benchmark::kMillisecond);

// A million photons that a detector sees which is blind for 20 ns after each.
void million_blind(benchmark::State& state) {
  test::FrameMaker made = experiment(true);
  made.background_per_ns = 1.2e-2;
  made.signal_per_pulse = 2;
  made.dead_time_ns = 20;
  estimate(state, made, {}, {}, {.dead_time_ns = 20 * double(state.range(0))});
}
BENCHMARK(million_blind)->ArgName("known")->DenseRange(0, 1)->Unit(benchmark::kMillisecond);

// One pulse in each period, as bright as forty together: no other delay looks alike.
void one_pulse(benchmark::State& state) {
  test::FrameMaker made = experiment(false);
  made.pattern = test::periodic_pattern(3780000);
  made.signal_per_pulse *= 40;
  estimate(state, made);
}
BENCHMARK(one_pulse)->Unit(benchmark::kMillisecond);

// A seventh of the signal of [P]'s experiment.
void weak(benchmark::State& state) {
  test::FrameMaker made = experiment(true);
  made.signal_per_pulse = 2e-4;
  estimate(state, made);
}
BENCHMARK(weak)->Unit(benchmark::kMillisecond);

// Every level of the search is gone through.
void no_target(benchmark::State& state) {
  test::FrameMaker made = experiment(false);
  made.signal_per_pulse = 0;
  estimate(state, made, {.effort = Effort(state.range(0))});
}
BENCHMARK(no_target)->ArgName("effort")->DenseRange(0, 1)->Unit(benchmark::kMillisecond);

// Ten times the background of [P]'s experiment, which makes 100,000 photons.
void bright_day(benchmark::State& state) {
  test::FrameMaker made = experiment(true);
  made.background_per_ns = 2e-3;
  made.velocity_mps = 50;
  estimate(state, made);
}
BENCHMARK(bright_day)->Unit(benchmark::kMillisecond);

// A million photons, half of them signal.
void million_bright(benchmark::State& state) {
  test::FrameMaker made = experiment(true);
  made.background_per_ns = 1e-2;
  made.signal_per_pulse = 0.95;
  estimate(state, made);
}
BENCHMARK(million_bright)->Unit(benchmark::kMillisecond);

// A million photons, of which 800 are signal, so that the target stands out by 90 nats.
void million_buried(benchmark::State& state) {
  test::FrameMaker made = experiment(true);
  made.background_per_ns = 2e-2;
  made.signal_per_pulse = 1.5e-3;
  estimate(state, made);
}
BENCHMARK(million_buried)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace splid
