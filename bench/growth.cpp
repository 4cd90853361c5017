// Measures how the time of a frame grows: with its photons, with how far the fastest target moves,
// with the pulses of the pattern, and with threads. Prints a table of each, and the fitted
// exponent.
//
//   growth    takes a minute on an idle core

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "bench/thread_clock.hpp"
#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker experiment() {
  test::FrameMaker made;
  made.pattern = test::random_pattern(3780000, 40, 9000, 5);
  made.velocity_mps = 30;
  return made;
}

double median_ms(const test::FrameMaker& made, double max_speed_mps, double& photons) {
  std::vector<test::FrameMaker::Frame> frames;
  std::size_t most = 0;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    frames.push_back(made.make(seed));
    most = std::max(most, frames.back().photons_ps.size());
  }
  photons = static_cast<double>(frames.front().photons_ps.size());
  FrameEstimator estimator(made.pattern, {}, {.max_speed_mps = max_speed_mps}, {}, made.length_ms,
                           most);
  std::vector<double> times_ms;
  for (int n = 0; n < 15; ++n) {
    const auto view = frames[static_cast<std::size_t>(n) % frames.size()].view();
    const double begin_ms = bench::thread_ms();
    estimator.estimate(view);
    times_ms.push_back(bench::thread_ms() - begin_ms);
  }
  std::nth_element(times_ms.begin(), times_ms.begin() + 7, times_ms.end());
  return times_ms[7];
}

// The slope of log y over log x, by the upper half of the points, where the time is long enough to
// matter.
double exponent(const std::vector<double>& x, const std::vector<double>& y) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = x.size() / 2; i < x.size(); ++i) {
    const double u = std::log(x[i]);
    const double v = std::log(y[i]);
    n += 1, sx += u, sy += v, sxx += u * u, sxy += u * v;
  }
  return (sxy - sx * sy / n) / (sxx - sx * sx / n);
}

struct Series {
  std::string what;
  std::vector<double> x, ms;

  void add(double at, double time_ms) {
    x.push_back(at);
    ms.push_back(time_ms);
    std::printf("| %s | %.6g | %.3g |\n", what.c_str(), at, time_ms);
    std::fflush(stdout);
  }
  void print_exponent() const {
    std::printf("| %s, exponent of the upper half | | %.2f |\n", what.c_str(), exponent(x, ms));
  }
};

void by_photons(const char* what, double signal_share) {
  Series series{what, {}, {}};
  for (const double wanted : {1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6}) {
    test::FrameMaker made = experiment();
    made.signal_per_pulse = std::max(signal_share * wanted, 400.0) / 529100;
    made.background_per_ns = (1 - signal_share) * wanted / 50e6;
    double photons = 0;
    const double ms = median_ms(made, 150, photons);
    series.add(photons, ms);
  }
  series.print_exponent();
}

// The share of signal of a bright frame of 250,000 photons, 0.05 counts a pulse.
void by_interleaved_photons() {
  Series series{"photons, a tenth of them signal, interleaved", {}, {}};
  for (const double wanted : {1e4, 3e4, 1e5, 1.5e5, 2e5, 2.5e5, 3e5, 4e5, 6e5, 1e6}) {
    test::FrameMaker made = experiment();
    made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
    made.signal_per_pulse = 0.05 * wanted / 2.5e5;
    made.background_per_ns = 4.5e-3 * wanted / 2.5e5;
    double photons = 0;
    const double ms = median_ms(made, 150, photons);
    series.add(photons, ms);
  }
  series.print_exponent();
}

void by_motion() {
  Series series{"v_max t_a, m", {}, {}};
  for (const double speed : {10.0, 40.0, 150.0, 600.0, 2400.0, 9600.0}) {
    double photons = 0;
    test::FrameMaker made = experiment();
    made.velocity_mps = 5;
    const double ms = median_ms(made, speed, photons);
    series.add(speed * 0.05, ms);
  }
  series.print_exponent();
}

void by_pulses() {
  Series series{"pulses a pattern of 37.8 us", {}, {}};
  for (const std::size_t pulses : {10, 40, 160, 640, 2560}) {
    test::FrameMaker made = experiment();
    made.pattern = test::random_pattern(37800000, pulses, 4000, 5);
    made.signal_per_pulse = 700 / (50e6 / 37800 * static_cast<double>(pulses));
    double photons = 0;
    const double ms = median_ms(made, 150, photons);
    series.add(static_cast<double>(pulses), ms);
  }
  series.print_exponent();
}

// The frames that several estimators do in a second at the same time, each on a thread of its own.
void by_threads() {
  const test::FrameMaker made = experiment();
  const auto frame = made.make(1);
  double alone = 0;
  for (unsigned threads = 1; threads <= std::max(2U, std::thread::hardware_concurrency());
       threads *= 2) {
    constexpr int frames = 400;
    std::vector<std::jthread> workers;
    const auto begin = std::chrono::steady_clock::now();
    for (unsigned i = 0; i < threads; ++i) {
      workers.emplace_back([&] {
        FrameEstimator estimator(made.pattern, {}, {}, {}, 50, frame.photons_ps.size());
        for (int n = 0; n < frames; ++n) estimator.estimate(frame.view());
      });
    }
    workers.clear();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    const double rate = frames * threads / took.count();
    if (threads == 1) alone = rate;
    std::printf("| threads, frames a second over those of one | %u | %.2f |\n", threads,
                rate / alone);
  }
}

}  // namespace
}  // namespace splid

int main() {
  using namespace splid;
  std::printf("| what | value | p50, ms of one core |\n|---|---|---|\n");
  by_photons("photons, 400 of them signal", 0);
  by_photons("photons, half of them signal", 0.5);
  by_interleaved_photons();
  by_motion();
  by_pulses();
  by_threads();
}
