#pragma once

#include <array>
#include <optional>
#include <vector>

namespace splid::studies {

// The order in which the arrays below hold the values of a frame. The delay is a value twice: at
// mid-frame, where splid publishes it, and at the frame's start, where [P] draws it.
enum Value { delay, velocity, signal, background, delay_start, values };
using AllValues = std::array<double, values>;

// One frame's estimate less the truth, as far as it has values.
struct TrialOutcome {
  bool has_values = false;
  AllValues error{};       // delays ns, velocity m/s, S counts/pulse, b counts/ns
  AllValues deviation{};   // published with them; 0: none, as of the delay at the start
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
  int no_value = 0;   // frames with no_target, or in which nothing was found
  int wrong = 0;      // wrong peaks: delay off by more than limit_ns
  int ambiguous = 0;  // frames whose odds ask for it, the mode aside
  int wrong_ok = 0;   // wrong peaks of the frames that are not, off by five of their own deviations
  AllValues rmse{};   // without frames on wrong peaks, units of TrialOutcome::error
  AllValues rmse_all{};                  // with these, as [P] draws it
  AllValues inside_one{}, inside_two{};  // shares of errors inside one and two deviations
  int with_deviation = 0;                // frames that published deviations
  double p50_ms = 0, p99_ms = 0;         // a frame
  double took_s = 0;                     // of the thread's time, with the making of the frames

  [[nodiscard]] int found() const { return trials - no_value; }
  [[nodiscard]] int right() const { return trials - no_value - wrong; }
  [[nodiscard]] int ok() const { return trials - no_value - ambiguous; }
  // One standard deviation of rmse, relative: 1 / sqrt(2 N). right() > 0.
  [[nodiscard]] double relative_error() const;
};

Score score(const std::vector<TrialOutcome>& outcomes, double wrong_peak_limit_ns);

}  // namespace splid::studies
