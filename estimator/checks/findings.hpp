#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "estimator/checks/finding.hpp"
#include "estimator/checks/map_fit.hpp"
#include "estimator/checks/pulse_table.hpp"
#include "estimator/checks/residual_map.hpp"
#include "estimator/model/chance.hpp"

namespace splid::checks {

// Twice the gain that chance reaches in one frame of a million, of a single term.
inline constexpr double sure_squares = 2 * certain_nats;
// The same of so many terms together.
double sure_squares_of(double degrees);

// Photons that a pulse's window is expected to have.
struct PulseLight {
  double light, dark;
};

// How the target was fitted, beside the values.
struct FitFacts {
  std::size_t track_terms = 2;  // 1 to 3: delay, range walk, quadratic term
  bool is_width_fitted = false;
  double std_delay_ns = 0;  // of the track's terms, as DelayTrack has them; 0: held
  double std_walk_ns = 0;
  double std_quadratic_ns = 0;
};

// A row's statistic of one frame, significant or not; for many frames together.
struct RowScore {
  std::array<double, 2> score{};        // of its first terms, orthogonal to the fitted parameters
  std::array<double, 2> information{};  // of these
  double squares = 0;                   // twice the gain of all its terms, less Bartlett's part
  double degrees = 0;                   // 0: the row was not looked at
  void add(const RowScore& more);
};

// What the findings of a target add to its deviations, pattern's clock.
struct Widening {
  // By how much the delay at mid-frame and the range walk may be off: adds to their variances.
  double off_delay_ns = 0, off_walk_ns = 0;
  // The deviations that the photons themselves show, with a sure finding; else 0. The larger of
  // these and the fit's is to be published.
  double least_delay_ns = 0, least_walk_ns = 0;
  double off_signal = 0, off_background = 0;  // parts of themselves
};

// What the photons say against the fitted model of a target, and what follows from it.
struct Verdict {
  // The most likely finding first, then those that stay sure beside it, in the order of the table.
  FoundList found;
  Widening wider;
  // The target's gain over the background beside its own pulses, where more light is there than
  // chance has in one frame of a hundred; to be judged by the frame's threshold.
  std::optional<double> gain_beside_nats;
  bool is_doubtful = false;  // other light takes part in what was taken for the target: ambiguous
  bool is_foreign = false;   // no target: the light is not that of the pattern's pulses

  [[nodiscard]] bool is_no_target(double threshold_nats) const {
    return is_foreign || (gain_beside_nats && *gain_beside_nats < threshold_nats);
  }
};

// Whether counts differ from what is expected by more than chance: the sum of (n - m)^2 - n, which
// is zero on average for counts of Poisson. Its tail is that of a gamma distribution of its own
// variance and skewness; chi squared of cells of less than a count has one that no factor mends.
struct SquareSum {
  double excess = 0;    // of squared deviations, less the part of chance
  double variance = 0;  // of it, by chance
  double third = 0;     // cumulant
  double scale = 0;     // squares of the light that is expected

  void add(double count, double expected, double light = 0) {
    excess += (count - expected) * (count - expected) - count;
    variance += 2 * expected * expected;
    third += expected * expected * (8 * expected + 4);
    scale += light * light;
  }
  // The same for so many counts of one expected value, by their sum and the sum of their squares.
  void add_alike(double cells, double expected, double sum, double squares) {
    excess += squares - 2 * expected * sum + cells * expected * expected - sum;
    variance += cells * 2 * expected * expected;
    third += cells * expected * expected * (8 * expected + 4);
  }
  // Chance exceeds a gain of g in about as many frames as a normal number exceeds sqrt(2 g).
  [[nodiscard]] double gain_nats() const {
    if (!(excess > 0) || !(variance > 0)) return 0;
    const double shape = 4 * variance * variance * variance / (third * third);
    const double more = excess / std::sqrt(variance * shape);
    return shape * (more - std::log1p(more));
  }
  // The relative rms deviation from the light that is expected.
  [[nodiscard]] double relative() const {
    return scale > 0 ? std::sqrt(std::fmax(excess, 0) / scale) : 0;
  }
};

// The statistics of a frame, significant or not; for many frames together.
struct FrameScores {
  std::array<RowScore, rows_with_directions> rows;
  SquareSum by_phase, by_phase_coarse, by_pulse;
};

// Judges a fitted target by the residual map about its track: screens all rows of finding_table()
// by their scores, and decides those that stand out by a fit of the richer model to the map.
class Findings {
 public:
  // dead_time_ns: of frames that come with it; else 0.
  Findings(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
           double dead_time_ns = 0);
  // model: fitted to this frame; target: which of its targets.
  const Verdict& judge(const FoldedFrame& frame, const likelihood::Model& model, std::size_t target,
                       const FitFacts& facts, const SeenParts& parts = seen_parts({}));
  // Of the target that was judged last.
  [[nodiscard]] const FrameScores& scores() const { return scores_; }
  [[nodiscard]] const ResidualMap& map() const { return map_; }
  // Of pulse p of a train of a single segment, in the frame that was judged last.
  [[nodiscard]] PulseLight expected_at(std::size_t p) const;
  // Its photons within two widths of the peak; 0, as expected_at(p) is, where other targets' pulses
  // come near.
  [[nodiscard]] double counted_at(std::size_t p) const {
    return seen_pulses_[p] > 0 ? map_.by_pulse()[p] : 0;
  }
  // The share of the light in phase bin k that the detector could see in that frame; 0 where the
  // light there is that of other targets.
  [[nodiscard]] double seen_at_phase(std::size_t k) const {
    if (!is_alone_) return 0;
    return seen_->of_phase.empty() ? 1 : seen_->of_phase[k];
  }

 private:
  using RowMoments = std::array<MapFit::Moments, rows_with_directions>;
  struct Candidate {  // a row that the screen let through, fitted
    std::size_t row = 0;
    double squares = 0, gain_nats = 0;
    Member member;
  };
  static const RowMoments& kernels();
  void list_terms(const FitFacts& facts);
  void screen(const FitFacts& facts);
  void score_row(std::size_t row);
  void keep_highest();
  void decide(const FoldedFrame& frame);
  [[nodiscard]] bool is_sure(const Candidate& candidate) const;
  void name_best(const FoldedFrame& frame);
  void say(std::size_t row, double gain_nats, const Member& member, const FoldedFrame& frame);
  void follow(const Member& richer, std::size_t row);
  void widen_by_parting(const Candidate& best);
  [[nodiscard]] double hidden_by_spread_ns(const Member& richer) const;
  void find_sandwich();
  void see_pulses(const likelihood::Model& model, std::size_t target);
  void judge_pulses();
  void judge_phases(const FoldedFrame& frame);
  void sum_phases(double mean, std::size_t group, std::span<const double> seen);
  struct PhaseGroup {  // sums over neighbouring free bins of phase
    double bins, sum, squares;
  };
  [[nodiscard]] PhaseGroup phases(std::size_t group) const;
  void judge_beside();
  [[nodiscard]] double fit_with(std::span<const std::size_t> rows, Member& member);
  [[nodiscard]] double bartlett(std::size_t row) const;

  PulseTable pulse_;
  const PulseTrain& train_;
  ResidualMap map_;
  SeenLightFinder seen_finder_;
  const SeenLight* seen_ = nullptr;
  MapFit fit_;
  const RowMoments& kernels_;  // of each row's functions of the time
  Verdict verdict_;
  FrameScores scores_;
  std::array<Term, most_terms> terms_;  // those fitted, then the rows'
  std::size_t fitted_ = 0, size_ = 0;
  bool is_alone_ = true;             // the frame has no other target
  std::vector<double> seen_pulses_;  // how much of each pulse's light could be seen
  std::array<std::size_t, rows_with_directions> first_term_, row_terms_;
  MapFit::Slopes slopes_;
  TermMatrix solved_;  // scratch
  std::vector<Candidate> candidates_;
  Member base_;
  double base_value_ = 0, light_of_pulses_ = 0, seen_amplitude_ = 0;
};

}  // namespace splid::checks
