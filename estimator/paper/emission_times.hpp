#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "estimator/model/pulse_train.hpp"

namespace splid::paper {

// The emission times e of [P] Eq. 1: the pulses of a train, which repeats for ever. All times are
// in ns of the pattern's clock. The pulses of one period are listed: of an MRR pattern with 25 ms
// of each rate, half a million take 8 MB.
class EmissionTimes {
 public:
  // pattern: valid.
  explicit EmissionTimes(const Pattern& pattern);

  [[nodiscard]] const PulseTrain& train() const { return train_; }
  [[nodiscard]] double period_ns() const { return train_.period_ns; }

  // Calls visit(offset_ns, amplitude) for each pulse whose offset, the phase less the pulse's time,
  // is in [first_ns, last_ns]. Pulses of the periods around are among them. |phase| < 2^31 periods.
  template <class Visit>
  void near(double phase_ns, double first_ns, double last_ns, Visit visit) const {
    double turn = std::floor((phase_ns - last_ns) / period_ns());
    for (std::size_t p = first_from(phase_ns - last_ns - turn * period_ns());; ++p) {
      if (p == times_ns_.size()) p = 0, turn += 1;
      const double offset_ns = phase_ns - (turn * period_ns() + times_ns_[p]);
      if (offset_ns < first_ns) return;
      visit(offset_ns, amplitudes_[p]);
    }
  }
  // Whether near() would visit any.
  [[nodiscard]] bool any_near(double phase_ns, double first_ns, double last_ns) const {
    const double turn = std::floor((phase_ns - last_ns) / period_ns());
    const std::size_t p = first_from(phase_ns - last_ns - turn * period_ns());
    const bool is_next = p == times_ns_.size();
    const double time_ns = (is_next ? turn + 1 : turn) * period_ns() + times_ns_[is_next ? 0 : p];
    return phase_ns - time_ns >= first_ns;
  }

 private:
  // The first pulse of a period at this time after its begin, or later.
  [[nodiscard]] std::size_t first_from(double time_ns) const {
    return static_cast<std::size_t>(std::lower_bound(times_ns_.begin(), times_ns_.end(), time_ns) -
                                    times_ns_.begin());
  }

  PulseTrain train_;
  std::vector<double> times_ns_, amplitudes_;  // of one period, ascending
};

}  // namespace splid::paper
