#pragma once

#include <cstddef>

#include "estimator/model/pulse_train.hpp"

namespace splid::paper {

// The emission times e of [P] Eq. 1: the pulses of a train, which repeats for ever. All times are
// in ns of the pattern's clock.
//
// Design note: the times are not listed. An MRR pattern with 25 ms of each rate has half a million
// pulses, and the pulses near a given time are found by a division.
class EmissionTimes {
 public:
  // pattern: valid.
  explicit EmissionTimes(const Pattern& pattern) : train_(pattern) {}

  [[nodiscard]] const PulseTrain& train() const { return train_; }
  [[nodiscard]] double period_ns() const { return train_.period_ns; }

  // Calls visit(offset_ns, amplitude) for each pulse whose offset, the phase less the pulse's time,
  // is in [first_ns, last_ns]. Pulses of the periods around are among them. |phase| < 2^31 periods.
  template <class Visit>
  void near(double phase_ns, double first_ns, double last_ns, Visit visit) const {
    for (Cursor at = first_from(phase_ns - last_ns);; step(at)) {
      const double offset_ns = phase_ns - time_of(at);
      if (offset_ns < first_ns) return;
      visit(offset_ns, train_.segments[at.segment].comb.amplitudes[at.pulse]);
    }
  }
  // Whether near() would visit any.
  [[nodiscard]] bool any_near(double phase_ns, double first_ns, double last_ns) const {
    return phase_ns - time_of(first_from(phase_ns - last_ns)) >= first_ns;
  }

 private:
  struct Cursor {
    double turn;  // whole pattern periods
    std::size_t segment;
    double repeat;  // whole periods of its comb
    std::size_t pulse;
  };
  [[nodiscard]] Cursor first_from(double time_ns) const;  // the first pulse at time_ns or later
  [[nodiscard]] double time_of(const Cursor& at) const {
    const PulseTrain::Segment& own = train_.segments[at.segment];
    return at.turn * train_.period_ns +
           (own.begin_ns + (at.repeat * own.comb.period_ns + own.comb.times_ns[at.pulse]));
  }
  void step(Cursor& at) const;

  PulseTrain train_;
};

}  // namespace splid::paper
