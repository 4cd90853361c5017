#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Notices a detector that is blind for longer after each detection than the configuration says, by
// the detections that should follow each other closely and do not.
//
// Of light of any kind at the mean rate r, of N photons at least N r L / 2 are followed by another
// within L, however the light is spread in time: the Fourier transform of the triangle of width L
// is nowhere below zero, so that its sum over all pairs is no less than that of even light. How
// many they would be is then counted at the same lags beyond whole periods of the pattern, at which
// light that repeats with the pattern has as many pairs as it has without such a lag, and a blind
// detector does not.
//
// Threads: one thread for each object. Errors: none. misfit_ns() allocates nothing.
class DeadTimeCheck {
 public:
  // dead_time_ns: as configured; 0: not given. inputs: >= 1, that share the light. train: outlives
  // this.
  DeadTimeCheck(const PulseTrain& train, const PulseShape& shape, double dead_time_ns,
                std::size_t inputs);

  // How long the detector is blind after each detection, as the photons show it, in ns of the
  // tagger's clock: the time within which hardly any detection follows another although thirty or
  // more should; of several inputs a rough value of it. Absent unless it exceeds the
  // configured dead time by a twentieth and the light that is lost in the rest of it biases a
  // value: the signal by more than half of its deviation, or the background by more than three.
  //
  // frame: locked to its syncs. times_ps: photons of it, in ascending order, at most those of
  // MiddlePhotons. estimate: of this frame.
  std::optional<double> misfit_ns(const FrameView& frame, std::span<const std::int64_t> times_ps,
                                  const Estimate& estimate);

 private:
  using Times = std::span<const std::int64_t>;

  // The light of a frame, as far as it matters here.
  struct Light {
    double per_ns;         // all photons
    double photons;        // of the frame
    double looked;         // photons that are looked at
    double S;              // photons of a pulse, on one input
    double in_deviations;  // the signal over its deviation; 0 where there is no signal
  };

  [[nodiscard]] double least_ns(const Light& light, double pairs) const;
  [[nodiscard]] bool biases(const Light& light, double blind_ns) const;
  std::optional<double> shortest_gap_ns(Times times_ps, const Light& light, double period_ns);
  [[nodiscard]] std::optional<double> gap_of_inputs_ns(Times times_ps, const Light& light,
                                                       double period_ns) const;
  [[nodiscard]] double control(Times times_ps, double to_ns, double period_ns) const;

  const PulseTrain& train_;
  double pulse_ns_;  // within which a pulse's photons follow each other
  double dead_time_ns_;
  double inputs_;
  std::vector<std::int64_t> gaps_ps_;  // scratch
};

}  // namespace splid
