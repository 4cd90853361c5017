#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "estimator/model/pulse_train.hpp"

namespace splid {

// Where the combs of two targets meet, in patterns of several rates: delays at which a target would
// have each of its pulses, at one rate or another, where one of the two has such pulses. With 180
// and 189 ns, two targets whose delays differ by a multiple of 9 ns meet at two more delays: one
// has the first target's pulses at 180 ns and the second one's at 189 ns, and one has the others.
class CombMeetings {
 public:
  // Patterns that are not of several rates have no meetings. width_ns: of the pulse; what is within
  // three widths of a pulse is where that pulse is.
  CombMeetings(const PulseTrain& train, double width_ns);

  static constexpr std::size_t most_places = 8;
  // Delays in [0, circle).
  class Places {
   public:
    [[nodiscard]] std::span<const double> delays_ns() const {
      return std::span(delays_ns_).first(count_);
    }
    void add(double delay_ns) { delays_ns_.at(count_++) = delay_ns; }
    [[nodiscard]] bool is_full() const { return count_ == delays_ns_.size(); }

   private:
    std::array<double, most_places> delays_ns_{};
    std::size_t count_ = 0;
  };
  // Where the combs of two targets meet, but for the targets' own delays.
  [[nodiscard]] Places find(double one_ns, double other_ns) const;
  // Whether they meet at a place, to within what the combs' places are known.
  [[nodiscard]] bool do_meet(double one_ns, double other_ns, double place_ns) const;

 private:
  [[nodiscard]] bool is_same(double one_ns, double other_ns) const;
  [[nodiscard]] bool meets_at(double place_ns, double one_ns, double other_ns,
                              double& off_ns) const;

  std::vector<double> periods_ns_;  // of the rates; empty where there are not several
  double circle_ns_;
  double tolerance_ns_;
};

}  // namespace splid
