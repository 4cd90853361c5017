#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/checks/path_check.hpp"
#include "estimator/checks/pulse_check.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "protocol/frame_status.hpp"

namespace splid {

// What the light of a target says of the pattern that the target was found with.
struct PatternVerdict {
  PatternFault fault = PatternFault::none;
  // Relative rms deviation of the pulses' light from the pattern's amplitudes, less the deviation
  // that chance makes. Absent where it is below 0.1, or below six standard deviations of chance's
  // part, and for patterns of several stretches or of less than four pulses.
  std::optional<double> amplitude_misfit;
};

// Checks whether the light of a found target is shared among the pulses as the pattern's amplitudes
// say, and whether most of that light is where the pattern has pulses at all.
//
// Amplitudes that are a little wrong bias neither delay nor velocity. They cost significance and a
// little accuracy, and S then belongs to another amplitude than it says. A pattern that was never
// played has a best delay all the same: the delay at which most of its pulses lie on pulses that
// were played. That is what the check is for.
//
// Where the frame has its blind time, each pulse is expected to show as much less light as the
// detector was blind when it came, and as its own first photon hides the others.
//
// Threads: one thread for each object. Errors: none. No allocation in judge().
class PatternCheck {
 public:
  // train: outlives this. reach_ns: that of the FoldedFrame which judge() will be given.
  // max_blind_photons: of a frame that comes with its blind time. is_fitted: the pulse's width is
  // fitted.
  PatternCheck(const PulseTrain& train, const PulseShape& shape, double reach_ns,
               std::size_t max_blind_photons, bool is_fitted = false);

  // found: the fit in this frame. Of more than 65,536 photons an even part is looked at. When the
  // detector was blind is known of all, and so are the pulses that hide much of their light then.
  //
  // The fault is dark_pulses where the pulses' light deviates from the amplitudes by more than 0.95
  // rms of their mean, as if less than 53 % of the pulses had any light, and by more than 4.5
  // standard deviations of what chance makes of pulses that deviate by 0.63. It is stray_pulses
  // where a pattern of less than eight pulses, in all its stretches together, has as much light
  // between its pulses as three pulses like its own would have, or more.
  PatternVerdict judge(const FoldedFrame& frame, const FrameParameters& found);
  // Whether the photons that the last judge() counted, with the same arguments, lie about their
  // pulses as the configured pulse says.
  [[nodiscard]] PulseVerdict judge_pulse(const FoldedFrame& frame,
                                         const FrameParameters& found) const;
  // Whether they lie as a gaussian says, where the pulse's width was fitted. found: that fit.
  [[nodiscard]] ShapeVerdict judge_shape(const FoldedFrame& frame, const FrameParameters& found,
                                         double sigma_ns) const;
  // Whether these photons lie about the path. is_bent: the frame was straightened by a bend that
  // was fitted.
  [[nodiscard]] PathVerdict judge_path(const FoldedFrame& frame, bool is_bent = false) const;
  [[nodiscard]] double reach_ns() const { return reach_ns_; }

 private:
  // What is looked at in one stretch of the train.
  struct Part {
    CombWindow window;
    std::size_t overlap;      // pulses whose light may be the same photon
    double turns;             // periods of the comb, in a pattern period, whose photons are counted
    std::size_t first_pulse;  // where its pulses begin in counts_
    std::size_t first_cover;  // where its steps begin in covers_: one a pulse, and the end
    std::size_t first_bin;    // where its bins begin in bins_
    std::size_t fine_bins;    // of phase, that tell how wide a pulse is; 0 where that is too many
    double bins_per_turn = 0;  // 0 where no light is looked for between the pulses
  };
  // Sums over all pulses, of photons; for amplitude_misfit and dark_pulses.
  struct Share {
    double excess = 0;     // squared deviations from the light that is expected, less chance's part
    double chance = 0;     // the variance of `excess` by chance alone
    double of_uneven = 0;  // the variance that amplitudes which deviate add, for a deviation of 1
    double scale = 0;      // squares of the light that is expected
    double inside = 0;     // squares of the light that is seen
    double expected = 0;   // light of all pulses
  };

  void note_kinds();
  void add_bins(const PulseTrain::Stretch& stretch, const PulseShape& shape, Part& part);
  void count(const FoldedFrame& frame, DelayLine line, std::size_t step);
  void expect(const FoldedFrame& frame, const FrameParameters& found, double periods);
  void add_hiding(std::size_t kind, double pulses, double blind, double photons);
  void settle_hiding(const FoldedFrame& frame, const FrameParameters& found);
  void count_part(const FoldedFrame& frame, DelayLine line, std::size_t step, std::size_t stretch);
  void cover_part(const FoldedFrame& frame, DelayLine line, std::size_t stretch);
  [[nodiscard]] std::size_t most_together(const Part& part, double period_ns) const;
  void count_about_pulses(const Part& part, const Comb& comb);
  void count_at(const Part& part, double phase, double period_ns, double share);
  template <class Visit>
  void for_phases(const FoldedFrame& frame, DelayLine line, std::size_t step, std::size_t stretch,
                  const Visit& visit) const;
  template <class Visit>
  void visit_near(const FoldedFrame& frame, DelayLine line, std::size_t step, std::size_t stretch,
                  const Visit& visit) const;
  [[nodiscard]] double background_in_bin(const FoldedFrame& frame, double background_per_ns) const;
  [[nodiscard]] Share share_out(double background_per_turn) const;
  [[nodiscard]] bool has_stray_pulses(const Share& share) const;

  const PulseTrain& train_;
  PulseCheck pulse_;
  PathCheck path_;
  double width_ns_;
  double window_ns_;
  double first_ns_, last_ns_;  // of the light that counts as a pulse's, about its time
  double reach_ns_;
  bool has_fine_bins_ = false;         // all parts have, and frames are of that many photons
  bool do_all_tell_width_ = false;     // all photons are in pulse_, and not a part of them
  std::size_t pulse_step_ = 1;         // one of so many photons each is in pulse_
  std::vector<Part> parts_;            // of each stretch
  std::vector<double> weights_;        // of each pulse: its share of the light, by the pattern
  std::vector<double> turns_;          // of each pulse: the `turns` of its part
  std::vector<std::uint8_t> kinds_;    // of each pulse: which of hiding_'s kinds it is
  HidingLight hiding_;                 // of the last judge()
  std::vector<double> counts_;         // of each pulse: the photons near it
  std::vector<double> light_;          // of each pulse: its weight times what the detector sees
  std::vector<double> seen_turns_;     // of each pulse: its turns times the share not blind
  std::vector<double> covers_;         // see cover_part()
  std::vector<std::uint32_t> phases_;  // scratch: photons by their phase
  std::vector<std::uint8_t> is_free_;  // of each bin: 1 where no pulse of the pattern reaches it
  std::vector<std::uint32_t> bins_;    // of each bin: its photons
};

}  // namespace splid
