#pragma once

#include <cstddef>
#include <vector>

#include "estimator/model/pulse_train.hpp"

namespace splid {

// Where the combs of two targets meet, in patterns of several rates: delays at which a target would
// have each of its pulses, at one rate or another, where one of the two has such pulses. With 180
// and 189 ns, two targets whose delays differ by a multiple of 9 ns meet at two more delays: one
// has the first target's pulses at 180 ns and the second one's at 189 ns, and one has the others.
//
// Threads: const, any. Errors: none.
class CombMeetings {
 public:
  // Patterns that are not of several rates have no meetings. width_ns: of the pulse; what is within
  // three widths of a pulse is where that pulse is.
  CombMeetings(const PulseTrain& train, double width_ns);

  // Writes the delays, in [0, circle), at which the combs of two targets meet, but for the targets'
  // own. places_ns: is cleared, and gets most_places at most.
  void find(double one_ns, double other_ns, std::vector<double>& places_ns) const;
  static constexpr std::size_t most_places = 8;

 private:
  [[nodiscard]] bool meets_at(double place_ns, double one_ns, double other_ns,
                              double& off_ns) const;

  std::vector<double> periods_ns_;  // of the rates; empty where there are not several
  double circle_ns_;
  double tolerance_ns_;
};

}  // namespace splid
