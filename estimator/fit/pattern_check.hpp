#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/fit/likelihood.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "protocol/messages.hpp"

namespace splid {

// What the light of a found target says of the pattern that it was found with.
struct PatternVerdict {
  PatternFault fault = PatternFault::none;
  // Relative rms deviation of the pulses' light from the pattern's amplitudes, less what chance
  // makes; absent where it is below 0.1 or six standard deviations of what chance makes of it, and
  // for a pattern of several stretches or of less than four pulses.
  std::optional<double> amplitude_misfit;
};

// Whether the light of a found target is shared among the pulses as the pattern's amplitudes say,
// and whether most of it is where the pattern has pulses at all.
//
// Amplitudes that are a little wrong bias neither delay nor velocity, but cost significance and a
// little accuracy, and S is then of another pulse than it says. A pattern that was not played has a
// best delay too: the one at which most of its pulses lie on some of those that were.
//
// Threads: one an object. Errors: none. No allocation in judge().
class PatternCheck {
 public:
  // train: outlives this. reach_ns: that of the frames that are folded on it (see FoldedFrame).
  PatternCheck(const PulseTrain& train, const PulseShape& shape, double reach_ns);

  // found: the fit in this frame. Of more than 65,536 photons an even part is looked at.
  //
  // dark_pulses: the pulses' light deviates from the amplitudes by more than 0.95 rms of their
  // mean, which is as if less than 53 % of them had any, and by more than 4.5 standard deviations
  // of what chance makes of pulses that deviate by 0.63. stray_pulses: a pattern of less than eight
  // pulses, in all its stretches together, leaves out as much light as three pulses more or less
  // like its own, or more, in places between them.
  PatternVerdict judge(const FoldedFrame& frame, const FrameParameters& found);

 private:
  // A stretch of the train.
  struct Part {
    CombWindow window;
    double turns;              // comb's periods in a pattern period that photons are looked at in
    std::size_t first_pulse;   // its pulses in counts_
    std::size_t first_bin;     // its bins in bins_
    double bins_per_turn = 0;  // 0: no pulses are looked for elsewhere
  };
  // Sums over pulses: see amplitude_misfit and dark_pulses.
  struct Share {
    double excess = 0;     // squared deviations from what is expected, less chance's
    double chance = 0;     // its variance, by chance alone
    double of_uneven = 0;  // what unevenness adds to that variance
    double scale = 0;      // squared light expected
    double inside = 0;     // squared light seen, less chance's
    double expected = 0;   // light
  };

  void add_bins(const PulseTrain::Stretch& stretch, const PulseShape& shape, Part& part);
  double count(const FoldedFrame& frame, DelayLine line);
  void count_part(const FoldedFrame& frame, DelayLine line, std::size_t step, std::size_t stretch);
  [[nodiscard]] Share share_out(double background_per_turn) const;
  [[nodiscard]] bool has_stray_pulses(const Share& share) const;

  const PulseTrain& train_;
  double window_ns_;
  std::vector<Part> parts_;            // one a stretch
  std::vector<double> weights_;        // light that a pulse should have, relative, one a pulse
  std::vector<double> turns_;          // comb's periods looked at, in a pattern period, one a pulse
  std::vector<double> counts_;         // photons near each pulse
  std::vector<std::uint8_t> is_free_;  // no pulse of the pattern reaches this bin
  std::vector<std::uint32_t> bins_;    // photons by their phase
};

}  // namespace splid
