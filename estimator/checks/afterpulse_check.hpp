#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "estimator/checks/pulse_mask.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Notices afterpulses: detections without light, which follow another detection within some
// microseconds of the end of its dead time and come out as background.
//
// Looked at is how long it takes from each detection to the next, and beside it how long it takes
// from the same instant whole periods of the pattern later. In both cases only those instants count
// after which nothing came within the dead time, so that all inputs are alive at its end. Light
// that repeats with the pattern then brings the next detection as soon in the one case as in the
// other, whatever it is: pulses, several returns, strong light on a blind detector, or light that
// changes slowly. Afterpulses bring it sooner in the first case alone. Next detections within a
// pulse of the targets that were found end a wait, and are not counted.
//
// Light that changes faster brings the next one sooner too, but about as much so at longer lags as
// at shorter ones. The quarter to the whole of the longest lag says how much that is, and half as
// much again is taken off.
//
// Where a first look at few of the photons leaves a doubt, up to 262,144 are looked at, with the
// same instants at three distances.
//
// Threads: one thread for each object. Errors: none. look() allocates nothing for frames of up to
// max_photons.
class AfterpulseCheck {
 public:
  // dead_time_ns: as configured; 0: not given. train: outlives this.
  AfterpulseCheck(const PulseTrain& train, const PulseShape& shape, double dead_time_ns,
                  std::size_t max_photons);

  // Gives the estimate its afterpulse_misfit, and to the deviation of the background the rate of
  // afterpulses, where the photons surely show them and they raise the background by more than
  // three deviations.
  //
  // frame: locked to its syncs. times_ps: photons of it, in ascending order; a part of frame's own
  // where those are in order. folded, estimate: of this frame. to_reference: as for PulseMask.
  void look(const FrameView& frame, std::span<const std::int64_t> times_ps,
            const FoldedFrame& folded, double to_reference, Estimate& estimate);

 private:
  using Times = std::span<const std::int64_t>;

  // Photons that are looked at, in ascending order.
  struct Looked {
    Times times_ps;
    std::span<const std::uint8_t> is_in_pulse;  // one for each of them; empty: none is

    [[nodiscard]] bool counts(std::size_t photon) const {
      return is_in_pulse.empty() || is_in_pulse[photon] == 0;
    }
  };

  // Lags after the dead time's end are counted up to 8.2 ns and its doubles: up to 4.2 us.
  static constexpr std::size_t rungs = 10;

  // How many next detections came up to each lag from the lag before.
  struct Waits {
    std::array<double, rungs + 1> ended = {};    // all; the last entry has all later ones
    std::array<double, rungs + 1> counted = {};  // those that are in no pulse
    std::array<double, rungs + 1> spread = {};   // the variance of `counted`
  };

  // Waits after detections, and after the same instants whole periods later.
  struct Both {
    Waits after, beyond;
    double instants = 0;   // an instant counts at each distance
    double distances = 0;  // at which all instants are looked at
    std::size_t last = 0;  // the longest lag
  };

  // How many detections light that ends as many waits has brought up to each lag, for each instant,
  // and the variance of that.
  struct Expected {
    std::array<double, rungs> sum = {}, variance = {};
  };

  // By how much afterpulses bring the next detection sooner.
  struct Excess {
    double deviations = 0;
    double share = 0;  // of the detections, that an afterpulse follows
  };

  [[nodiscard]] std::size_t longest(double per_ns) const;
  [[nodiscard]] double control_lag_ns(const FrameView& frame, std::size_t last) const;
  [[nodiscard]] static std::size_t enough_to_doubt(double per_ns, double least);
  [[nodiscard]] double excess_at_once(Times times_ps, double per_ns) const;
  void count(Both& waits, const Looked& photons, std::int64_t control_ps) const;
  [[nodiscard]] Excess excess(const Looked& photons, double control_ns, std::size_t last,
                              int distances) const;
  [[nodiscard]] static Expected expected(const Waits& waits, double instants, std::size_t last);
  [[nodiscard]] static Excess excess_of(const Both& waits);

  PulseMask mask_;
  double period_ns_;      // of the pattern, within which all of its parts repeat; its own clock
  double in_pattern_;     // ns of the pattern's period, by which syncs give it
  std::int64_t from_ps_;  // the dead time, or the pulse where that is longer
};

}  // namespace splid
