// Counts how many frames without a target claim a target, beside the rate that the configuration's
// estimator.false_alarm_rate allows.
//
//   false_alarms [FRAMES [RATE]]    by default 20,000 frames for each row and a rate of 1e-3, which
//                                   takes some minutes

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

struct Scene {
  const char* name;
  Pattern pattern;
  double length_ms;
  double background_per_ns;
  Effort effort;
};

// The 95 % interval of a Poisson count, by its square root. It is good to a few per cent from two
// claims on.
void print_row(const Scene& scene, int frames, int claims, double largest_nats) {
  const double root = std::sqrt(static_cast<double>(claims));
  const double low = std::pow(std::max(0.0, root - 0.98), 2) / frames;
  const double high = std::pow(root + 0.98 + (claims == 0 ? 0.75 : 0), 2) / frames;
  std::printf("| %s, %s | %g | %g | %d of %d | %.1e to %.1e | %.1f |\n", scene.name,
              to_string(scene.effort), scene.length_ms, scene.background_per_ns, claims, frames,
              low, high, largest_nats);
  std::fflush(stdout);
}

void run(const Scene& scene, int frames, double rate) {
  test::FrameMaker made;
  made.pattern = scene.pattern;
  made.length_ms = scene.length_ms;
  made.signal_per_pulse = 0;
  made.background_per_ns = scene.background_per_ns;
  EstimatorOptions options;
  options.effort = scene.effort;
  options.false_alarm_rate = rate;
  const double expected = scene.length_ms * 1e6 * scene.background_per_ns;
  FrameEstimator estimator(scene.pattern, {}, {}, options, scene.length_ms,
                           static_cast<std::size_t>(2 * expected + 1000));
  int claims = 0;
  double largest_nats = 0;
  for (int n = 0; n < frames; ++n) {
    const Estimate e = estimator.estimate(made.make(static_cast<std::uint64_t>(n)).view());
    claims += e.has_values ? 1 : 0;
    largest_nats = std::max(largest_nats, e.significance_nats);
    if (n % 500 == 0) std::fprintf(stderr, "\r%s: %d of %d", scene.name, n, frames);
  }
  std::fprintf(stderr, "\r%40s\r", "");
  print_row(scene, frames, claims, largest_nats);
}

}  // namespace
}  // namespace splid

int main(int count, char** arguments) {
  using namespace splid;
  const int frames = count > 1 ? std::atoi(arguments[1]) : 20000;
  const double rate = count > 2 ? std::atof(arguments[2]) : 1e-3;
  if (frames <= 0 || !(rate > 0 && rate < 0.5)) {
    std::fprintf(stderr, "usage: false_alarms [FRAMES [RATE]]\n");
    return 2;
  }
  const Pattern interleaved = test::interleaved_pattern({180000, 189000}, 3780000);
  const Pattern random = test::random_pattern(3780000, 40, 9000, 5);
  const Pattern rates = test::mrr_pattern({180000, 189000}, 3780000, 1e9);
  std::printf("Stated: %g a frame.\n\n", rate);
  std::printf(
      "| pattern, effort | t_a, ms | b, /ns | claims | rate, 95 %% | largest gain, nats |\n");
  std::printf("|---|---|---|---|---|---|\n");
  for (const Scene& scene : {Scene{"interleaved", interleaved, 50, 1.75e-4, Effort::fast},
                             Scene{"interleaved", interleaved, 50, 1.75e-4, Effort::balanced},
                             Scene{"random", random, 50, 1.75e-4, Effort::balanced},
                             Scene{"rates in turn", rates, 50, 1.75e-4, Effort::balanced},
                             Scene{"random", random, 5, 1e-3, Effort::balanced},
                             Scene{"random", random, 0.5, 1e-2, Effort::balanced}}) {
    run(scene, frames, rate);
  }
}
