#pragma once

#include <span>
#include <vector>

#include "estimator/model/comb.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {

// A detector that is dead for dead_time_ns after each detection, also where it is one of several
// `inputs` that share the light evenly.
struct DeadDetector {
  double dead_time_ns = 0;  // 0: never dead
  double inputs = 1;
};

// The light of a target: its comb comes so much later than the phase that is asked for.
struct CombLight {
  double shift_ns = 0;
  double signal_per_pulse = 0;
  double dilation = 1;  // of the detected pulses, over phases by emission
};

// The chance that such a detector is live, by the phase in a comb, once it has forgotten its first
// state: live(t) = 1 - integral over the last dead time of live lambda, stepped in cells of an
// eighth of the pulse's width until a period repeats the one before. To 1e-3; beyond dead times of
// half a million widths light is taken as steady. For studies: 4 us take milliseconds.
class LiveFraction {
 public:
  // lights: of one target or more. b: in the tagger's ns, of which the first one's dilation tells
  // how many a ns of the comb has.
  LiveFraction(const PulseShape& shape, const Comb& comb, std::span<const CombLight> lights,
               double b, const DeadDetector& detector);

  // phase_ns: in [0, period), by emission.
  [[nodiscard]] double at(double phase_ns) const;
  [[nodiscard]] double mean() const { return mean_; }

 private:
  [[nodiscard]] std::vector<double> chances(const PulseShape& shape, const Comb& comb,
                                            std::span<const CombLight> lights, double b,
                                            double inputs) const;
  void settle(const std::vector<double>& chances, double cells_dead);

  double cells_per_ns_;
  std::vector<double> live_;  // at the begin of each cell
  double mean_ = 1;
};

}  // namespace splid
