// Two targets of the same signal, or nearly, whose places the combs of two rates may mix up: a
// table docs/evidence/data/equal-targets.csv.
//
//   equal_targets [TRIALS]     by default 1000 frames for each row, which takes a minute

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double m_per_ns_of_delay = 0.299792458 / 2;
constexpr double near_ns = 0.5;  // five pulse widths

struct Kind {
  const char* name;
  Pattern pattern;
  double share = 1;       // the second target's signal, as a part of the first one's
  double faster_mps = 0;  // the second target
};

struct Count {
  int right = 0, ambiguous = 0, ambiguous_right = 0, wrong = 0;
};

bool is_near(const TargetEstimate& found, const test::FrameMaker& truth) {
  const double circle_ns = truth.pattern.unambiguous_delay_ps * 1e-3;
  const double off = found.delay_ns - truth.distance_m / m_per_ns_of_delay;
  return std::abs(std::remainder(off, circle_ns)) < near_ns;
}

// Of frames that list two targets: whether both are sure, and whether they are where the two are.
void judge(const Estimate& e, const test::FrameMaker& first, const test::FrameMaker& second,
           Count& count) {
  if (e.target_count != 2) return;
  const TargetEstimate& a = e.targets[0];
  const TargetEstimate& b = e.targets[1];
  const bool are_there =
      (is_near(a, first) && is_near(b, second)) || (is_near(a, second) && is_near(b, first));
  const bool are_sure =
      e.status == FrameStatus::ok && a.status == FrameStatus::ok && b.status == FrameStatus::ok;
  if (are_sure) ++(are_there ? count.right : count.wrong);
  if (!are_sure) ++count.ambiguous;
  if (!are_sure && are_there) ++count.ambiguous_right;
}

void run(const Kind& kind, double apart_ns, int trials) {
  test::FrameMaker first;
  first.pattern = kind.pattern;
  first.velocity_mps = 12.5;
  test::FrameMaker second = first;
  second.distance_m += apart_ns * m_per_ns_of_delay;
  second.signal_per_pulse *= kind.share;
  second.velocity_mps += kind.faster_mps;
  SceneOptions scene;
  scene.targets = 2;
  FrameEstimator estimator(kind.pattern, {}, scene, {}, first.length_ms, 200'000);
  Count count;
  for (int n = 1; n <= trials; ++n) {
    const auto frame = first.make_with({second}, static_cast<std::uint64_t>(n));
    judge(estimator.estimate(frame.view()), first, second, count);
  }
  std::printf("| %s | %g | %d | %d, %d | %d |\n", kind.name, apart_ns, count.right, count.ambiguous,
              count.ambiguous_right, count.wrong);
  std::fflush(stdout);
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 1000;
  const splid::Pattern in_turn = splid::test::mrr_pattern({180000, 189000}, 3780000, 2e9);
  const std::vector<splid::Kind> kinds = {
      {"rates in turn", in_turn},
      {"rates in turn, the second of 0.7", in_turn, 0.7},
      {"rates in turn, the second of 0.5", in_turn, 0.5},
      {"rates in turn, the second 0.5 m/s faster", in_turn, 1, 0.5},
      {"interleaved", splid::test::interleaved_pattern({180000, 189000}, 3780000)},
      {"random", splid::test::random_pattern(3780000, 40, 9000, 5)}};
  std::printf(
      "| pattern | apart, ns | sure, both right | `ambiguous`, of these both right | sure, wrong "
      "|\n"
      "|---|---|---|---|---|\n");
  for (const splid::Kind& kind : kinds) {
    for (const double apart_ns : {9.0, 18.0, 45.0, 90.0, 20.0}) splid::run(kind, apart_ns, trials);
  }
}
