#pragma once

#include <cstddef>
#include <vector>

#include "protocol/pattern.hpp"

namespace splid::paper {

// The emission times e of [P] Eq. 1 over one pattern period, which repeats for ever: one pulse
// train after the other, each from a segment of the pattern. All times are in ns of the pattern's
// clock.
//
// Design note: the times are kept as trains, not as a list. An MRR pattern with 25 ms of each rate
// has half a million pulses, and the pulses near a given time are found by a division.
//
// Threads: const, any.
class EmissionTimes {
 public:
  struct Train {
    double begin_ns = 0;           // in the pattern period
    double length_ns = 0;          // period times repeats
    double period_ns = 0;          // of the train
    std::vector<double> times_ns;  // of its pulses, in [0, period), ascending
    std::vector<double> amplitudes;
    double amplitude = 0;  // sum over the pulses of one period
  };

  // pattern: valid. Pulses of amplitude zero are left out.
  explicit EmissionTimes(const Pattern& pattern);

  [[nodiscard]] double period_ns() const { return period_ns_; }
  [[nodiscard]] const std::vector<Train>& trains() const { return trains_; }
  [[nodiscard]] double amplitude_per_ns() const { return amplitude_ / period_ns_; }

  // Calls visit(offset_ns, amplitude) for each pulse whose offset, the phase less the pulse's time,
  // is in [first_ns, last_ns]. Pulses of the periods around are among them. |phase| < 2^31 periods.
  template <class Visit>
  void near(double phase_ns, double first_ns, double last_ns, Visit visit) const {
    for (Cursor at = first_from(phase_ns - last_ns);; step(at)) {
      const double offset_ns = phase_ns - time_of(at);
      if (offset_ns < first_ns) return;
      visit(offset_ns, trains_[at.train].amplitudes[at.pulse]);
    }
  }
  // Whether near() would visit any.
  [[nodiscard]] bool any_near(double phase_ns, double first_ns, double last_ns) const {
    return phase_ns - time_of(first_from(phase_ns - last_ns)) >= first_ns;
  }

 private:
  struct Cursor {
    double turn;  // whole pattern periods
    std::size_t train;
    double repeat;  // whole periods of the train
    std::size_t pulse;
  };
  [[nodiscard]] Cursor first_from(double time_ns) const;  // the first pulse at time_ns or later
  [[nodiscard]] double time_of(const Cursor& at) const {
    const Train& train = trains_[at.train];
    return at.turn * period_ns_ +
           (train.begin_ns + (at.repeat * train.period_ns + train.times_ns[at.pulse]));
  }
  void step(Cursor& at) const;

  std::vector<Train> trains_;
  double period_ns_;
  double amplitude_ = 0;
};

}  // namespace splid::paper
