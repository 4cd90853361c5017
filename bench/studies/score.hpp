#pragma once

#include <array>
#include <optional>
#include <vector>

namespace splid::studies {

// The order in which the arrays below hold the four values of a frame.
enum Value { delay, velocity, signal, background, values };
using FourValues = std::array<double, values>;

// One frame's estimate less the truth, as far as it has values.
struct TrialOutcome {
  bool has_values = false;
  FourValues error{};      // delay at mid-frame ns, velocity m/s, S counts/pulse, b counts/ns
  FourValues deviation{};  // published with them; 0: none
  bool ambiguous = false;  // range odds below those of the default risk
  double compute_ms = 0;   // of the thread's own time
};

struct Share {
  double low = 0, high = 0;
};

// 95 % interval of a share seen `hits` times in `trials` (Wilson 1927); good at 0 hits too.
// trials > 0.
Share wilson_95(int hits, int trials);

// The numbers that the tables print of a job.
struct Score {
  int trials = 0;
  int no_value = 0;  // frames with no_target, or in which nothing was found
  int wrong = 0;     // wrong peaks: delay off by more than limit_ns
  int ambiguous =
      -1;             // frames whose odds ask for it, the mode aside; -1: older result, not counted
  int wrong_ok = -1;  // wrong peaks of the frames that are not, off by five of their own deviations
  FourValues rmse{};  // of the rest, units of TrialOutcome::error
  FourValues inside_one{}, inside_two{};  // shares of errors inside one and two deviations
  int with_deviation = 0;                 // frames that published deviations
  double p50_ms = 0, p99_ms = 0;

  [[nodiscard]] int right() const { return trials - no_value - wrong; }
  [[nodiscard]] bool has_odds() const { return ambiguous >= 0; }
  [[nodiscard]] int ok() const { return trials - no_value - ambiguous; }  // has_odds()
  // One standard deviation of rmse, relative: 1 / sqrt(2 N). right() > 0.
  [[nodiscard]] double relative_error() const;
};

Score score(const std::vector<TrialOutcome>& outcomes, double wrong_peak_limit_ns);

}  // namespace splid::studies
