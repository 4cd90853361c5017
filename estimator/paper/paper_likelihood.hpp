#pragma once

#include <cstddef>
#include <vector>

#include "estimator/model/pulse_shape.hpp"
#include "estimator/paper/corrected_times.hpp"
#include "estimator/paper/emission_times.hpp"

namespace splid::paper {

// What [P] estimates of a frame. The delay is in the pattern's clock; rates count the tagger's ns.
struct PaperParameters {
  double delay_ns = 0;  // tau, round trip at the frame's start
  double velocity_mps = 0;
  double signal_per_pulse = 0;   // S >= 0
  double background_per_ns = 0;  // b > 0
};

// The log-likelihood as [P] writes it: l = -integral lambda + sum_j log lambda(T_j), with Eq. 2's
// lambda(t) = b + S sum_e a_e h(t - tau / (1 - beta) - e (1 + beta) / (1 - beta)) over all emission
// times e, those before the frame included ([P] Eq. 4 and 7, whose print lacks the logarithm), less
// that of no target, S = 0 and b = N / t. Pulses in a loss count by their mean rate.
//
// Design note: written in (tau, v), apart from LogLikelihood, so that the two check each other.
class PaperLikelihood {
 public:
  PaperLikelihood(const CorrectedTimes& frame, const EmissionTimes& emission,
                  const PulseShape& shape);

  struct Point {
    double gain_nats = 0;
    double by_delay = 0;       // derivatives: nats per ns,
    double by_velocity = 0;    // per m/s,
    double by_signal = 0;      // per count a pulse,
    double by_background = 0;  // per count a ns
  };
  // Sets tau and v. Most of the work is here, as the pulses of each photon are found anew. Photons
  // that no pulse can be near to are not looked at again until the line has moved by more than a
  // few pulse widths. The values do not depend on where the line was before.
  void move_to(double delay_ns, double velocity_mps);
  // The gain and its derivatives at the tau and v that were set last. background_per_ns > 0.
  [[nodiscard]] Point evaluate(double signal_per_pulse, double background_per_ns) const;

  [[nodiscard]] double photons() const { return photons_; }
  [[nodiscard]] double seen_ns() const { return seen_ns_; }      // tagger's clock
  [[nodiscard]] double amplitude() const { return amplitude_; }  // of the pulses seen, at rest
  [[nodiscard]] double length_ns() const { return frame_.length_ns; }
  [[nodiscard]] double width_ns() const { return shape_.width_ns(); }

 private:
  struct Near {              // a photon with pulses in its neighbourhood
    double density = 0;      // sum_p a_p h
    double by_delay = 0;     // its derivatives
    double by_velocity = 0;  //
  };
  struct Window {  // of offsets from a pulse, in the pattern's clock
    double first_ns, last_ns;
  };
  void collect(double delay_ns, double beta);
  // Sees to it that likely_near_ has all photons that pulses are near to. line_ns: the delay that
  // is taken off the photons' phases.
  void note_near(const Window& window, double line_ns);
  [[nodiscard]] double moved_since_noted_ns(const Window& window, double line_ns) const;

  const CorrectedTimes& frame_;
  const EmissionTimes& emission_;
  const PulseShape& shape_;
  double photons_;
  double seen_ns_;
  double amplitude_;
  double rate_ = 0;         // g = 2 beta / (1 + beta)
  double rate_by_mps_ = 0;  // dg / dv
  std::vector<Near> near_;
  // The photons that may be near a pulse, and where the line was when they were noted.
  std::vector<std::size_t> likely_near_;
  bool noted_ = false;
  double noted_line_ns_ = 0;
  double noted_rate_ = 0;
  Window noted_window_ = {};
  // One entry for each pair of a photon and a pulse near it.
  std::vector<double> offset_ns_, pair_amplitude_, by_velocity_, h_, d1_, d2_;
  std::vector<std::size_t> first_;  // pairs of near photon k begin here
};

}  // namespace splid::paper
