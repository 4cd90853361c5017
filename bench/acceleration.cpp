// What it brings to estimate an acceleration, and what it costs to leave it out: errors beside the
// bound of a target whose acceleration is unknown, for each scene.motion.
//
//   acceleration [TRIALS [SHORTEST_MS [LONGEST_MS]]]   by default 300 frames for each row, and a
//                                                       tenth as many from 1 s on; 50 to 2000 ms
//   acceleration jerk [TRIALS]     accelerations that change: by default 300 frames for each row

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
#include "estimator/model/pulse_shape.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double m_per_ns_of_delay = 0.299792458 / 2;

struct Row {
  Motion motion;
  const char* name;
};

constexpr Row rows[] = {{Motion::moving, "moving"},
                        {Motion::automatic, "auto"},
                        {Motion::accelerating, "accelerating"}};

// Errors in units of the bound, and how many of them are within the published deviation.
struct Errors {
  double squares = 0;
  int inside = 0;

  void add(double error, double bound, double deviation) {
    squares += std::pow(error / bound, 2);
    inside += std::abs(error) <= deviation ? 1 : 0;
  }
  [[nodiscard]] double rms(int n) const { return std::sqrt(squares / std::max(n, 1)); }
  [[nodiscard]] double share(int n) const { return 100.0 * inside / std::max(n, 1); }
};

struct Score {
  int valid = 0, wrong = 0, warned = 0, wrong_warned = 0, curved = 0, right = 0;
  Errors distance, velocity, acceleration;
  std::vector<double> took_ms;
};

test::FrameMaker scene(double length_ms, double signal_per_pulse) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = length_ms;
  made.signal_per_pulse = signal_per_pulse;
  return made;
}

void measure(const test::FrameMaker& made, const Bound& bound, FrameEstimator& estimator,
             std::uint64_t seed, Score& score) {
  const auto frame = made.make(seed);
  const double begin_ms = bench::thread_ms();
  const Estimate e = estimator.estimate(frame.view());
  score.took_ms.push_back(bench::thread_ms() - begin_ms);
  if (!e.has_values) return;
  ++score.valid;
  const double off_ns = std::remainder(e.delay_ns - made.distance_m / m_per_ns_of_delay, 3780.0);
  const bool warns = !e.findings.all().empty();
  score.warned += warns ? 1 : 0;
  // Beyond a tenth of the pulses' distance it is another delay.
  if (std::abs(off_ns) > 0.9) {
    ++score.wrong;
    score.wrong_warned += warns ? 1 : 0;
    return;
  }
  ++score.right;
  score.distance.add(off_ns, bound.delay_ns, e.std_delay_ns);
  score.velocity.add(e.velocity_mps - made.velocity_mps, bound.velocity_mps, e.std_velocity_mps);
  if (e.std_acceleration_mps2 <= 0) return;
  ++score.curved;
  score.acceleration.add(e.acceleration_mps2 - made.acceleration_mps2, bound.acceleration_mps2,
                         e.std_acceleration_mps2);
}

void run(const Row& row, double length_ms, double acceleration_mps2, double signal_per_pulse,
         int trials) {
  test::FrameMaker made = scene(length_ms, signal_per_pulse);
  const double length_ns = length_ms * 1e6;
  const Bound bound =
      cramer_rao_bound(made.pattern, *make_gaussian(made.sigma_ns),
                       {length_ns, length_ns, made.distance_m / m_per_ns_of_delay, 0,
                        made.signal_per_pulse, made.background_per_ns, true, true});
  FrameEstimator estimator(made.pattern, {}, {.motion = row.motion}, {}, length_ms,
                           static_cast<std::size_t>(length_ns * 5e-4) + 10000);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> velocity(-100, 100), distance(284, 285);
  Score score;
  for (int n = 0; n < trials; ++n) {
    made.velocity_mps = velocity(random);
    made.distance_m = distance(random);
    made.acceleration_mps2 = n % 2 == 0 ? acceleration_mps2 : -acceleration_mps2;
    measure(made, bound, estimator, static_cast<std::uint64_t>(n), score);
  }
  std::nth_element(score.took_ms.begin(), score.took_ms.begin() + trials / 2, score.took_ms.end());
  const int n = score.right;
  std::printf("| %g | %g | %g | %s | %d of %d | %d | %d, %d | %d |", length_ms, acceleration_mps2,
              signal_per_pulse, row.name, score.valid, trials, score.wrong, score.warned,
              score.wrong_warned, score.curved);
  if (n == 0) {
    std::printf(" | | | | |");
  } else {
    std::printf(" %.3g | %.0f %% | %.3g | %.0f %% |", score.distance.rms(n),
                score.distance.share(n), score.velocity.rms(n), score.velocity.share(n));
    if (score.curved == 0) {
      std::printf(" |");
    } else {
      std::printf(" %.3g, %.0f %% |", score.acceleration.rms(score.curved),
                  score.acceleration.share(score.curved));
    }
  }
  std::printf(" %.3g |\n", score.took_ms[static_cast<std::size_t>(trials) / 2]);
  std::fflush(stdout);
}

// What frames say of an acceleration that changes, and how far their values are off by it.
struct Turned {
  int valid = 0, wrong = 0, said = 0, said_otherwise = 0, said_later = 0, curved = 0;
  Errors distance, velocity;  // in published deviations

  void add(const Estimate& e, const test::FrameMaker& made) {
    if (!e.has_values) return;
    ++valid;
    const bool has_jerk = e.findings.has(FindingName::jerk);
    said += has_jerk ? 1 : 0;
    said_otherwise += has_jerk || e.findings.all().empty() ? 0 : 1;
    said_later += e.recent_findings.all().empty() ? 0 : 1;
    curved += e.std_acceleration_mps2 > 0 ? 1 : 0;
    const double off_ns = std::remainder(e.delay_ns - made.distance_m / m_per_ns_of_delay, 3780.0);
    if (std::abs(off_ns) > 0.9) {
      ++wrong;
      return;
    }
    distance.add(off_ns, e.std_delay_ns, e.std_delay_ns);
    if (e.std_velocity_mps == 0) return;
    velocity.add(e.velocity_mps - made.velocity_mps, e.std_velocity_mps, e.std_velocity_mps);
  }
};

void run_turned(const Row& row, double length_ms, double jerk_mps3, double signal_per_pulse,
                int trials) {
  test::FrameMaker made = scene(length_ms, signal_per_pulse);
  FrameEstimator estimator(made.pattern, {}, {.motion = row.motion, .max_acceleration_mps2 = 20},
                           {}, length_ms, static_cast<std::size_t>(length_ms * 500) + 10000);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> velocity(-100, 100), distance(284, 285);
  Turned turned;
  for (int n = 0; n < trials; ++n) {
    made.velocity_mps = velocity(random);
    made.distance_m = distance(random);
    made.jerk_mps3 = n % 2 == 0 ? jerk_mps3 : -jerk_mps3;
    const auto frame = made.make(static_cast<std::uint64_t>(n));
    turned.add(estimator.estimate(frame.view()), made);
  }
  const int right = turned.valid - turned.wrong;
  std::printf(
      "| %g | %g | %g | %s | %d | %d | %d, %d, %d | %d | %.3g | %.0f %% | %.3g | %.0f %% |\n",
      length_ms, jerk_mps3, signal_per_pulse, row.name, turned.valid, turned.wrong, turned.said,
      turned.said_otherwise, turned.said_later, turned.curved, turned.distance.rms(right),
      turned.distance.share(right), turned.velocity.rms(right), turned.velocity.share(right));
  std::fflush(stdout);
}

void run_all_turned(int trials) {
  std::printf(
      "| t_a, ms | j, m/s^3 | S | motion | valid | wrong delay | finds a jerk, another, recently | "
      "with a | distance error / published | within | velocity error / published | within |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  struct Turn {
    double length_ms, signal;
    std::vector<double> jerks_mps3;
  };
  const Turn turns[] = {{50, 13.5e-4, {0, 300, 1000}},
                        {200, 13.5e-4, {0, 3, 10, 30, 1000}},
                        {1000, 2.7e-4, {0, 0.1, 0.3, 1, 10}}};
  for (const Turn& turn : turns) {
    const int frames = turn.length_ms > 500 ? std::max(2, trials / 10) : trials;
    for (const double jerk_mps3 : turn.jerks_mps3) {
      for (const Row& row : rows) {
        if (row.motion == Motion::moving) continue;  // says nothing of it
        run_turned(row, turn.length_ms, jerk_mps3, turn.signal, frames);
      }
    }
  }
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "jerk") {
    splid::run_all_turned(argc > 2 ? std::atoi(argv[2]) : 300);
    return 0;
  }
  const int trials = argc > 1 ? std::atoi(argv[1]) : 300;
  const double shortest_ms = argc > 2 ? std::atof(argv[2]) : 50;
  const double longest_ms = argc > 3 ? std::atof(argv[3]) : 2000;
  std::printf(
      "| t_a, ms | a, m/s^2 | S | motion | valid | wrong delay | warned, of wrong | with a | "
      "distance / bound | "
      "within | velocity / bound | within | a / bound, within | p50, ms |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const double length_ms : {50.0, 200.0, 1000.0, 2000.0}) {
    if (length_ms < shortest_ms || length_ms > longest_ms) continue;
    // Longer frames gather as many photons in all from a fifth of the light.
    const bool is_long = length_ms > 500;
    const double signal = is_long ? 2.7e-4 : 13.5e-4;
    const int frames = is_long ? std::max(2, trials / 10) : trials;
    for (const double acceleration_mps2 : {0.0, 0.4, 10.0, 100.0}) {
      for (const splid::Row& row : splid::rows) {
        splid::run(row, length_ms, acceleration_mps2, signal, frames);
      }
    }
  }
}
