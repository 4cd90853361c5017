#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "estimator/several/crossing_check.hpp"
#include "estimator/several/flank_check.hpp"
#include "estimator/several/joint_likelihood.hpp"
#include "estimator/several/moving_light.hpp"

namespace splid {

// Which targets of a joint fit are claimed. The others stay in the fit, as they may be what the
// pulse of a target leaves over.
//
// Design note: no pulse is quite what the configuration says. What a wrong width or a tail leaves
// over looks like a target beside the true one that moves with it. So a target is not claimed
//  - closer than 2.5 pulse widths to another (root mean square over the frame): up to there, two
//    pulses fit any pulse that is up to 1.6 times as wide. Two whose lines part over the frame, as
//    the light of no pulse does, may be as close as that shows them (CrossingCheck; MovingLight
//    where one is weak);
//  - within 30 widths of a brighter target, unless the light falls between the two and rises again,
//    by two standard deviations, and then ends. A tail only falls.
//    A target of less than a fifth of the bright one's signal that is within 8 widths of it is
//    claimed where it explains the light there better than a bright pulse of another shape does, by
//    three nats (FlankCheck). Its light cannot be seen to fall and rise beside so much other.
// Three targets close to each other are not told from a wide pulse before all of them are known. So
// those that stand in a row are claimed in the end, where the light falls between neighbours and
// rises again.
//
// Threads: one thread for each object. Errors: none. No allocation.
class TargetClaims {
 public:
  // Two targets closer than this, root mean square over the frame, are not told apart.
  static constexpr double closest_widths = 2.5;
  // A pulse's tail reaches so far.
  static constexpr double tail_widths = 30;

  // shape, train, likelihood: outlive this. false_alarm_rate: the chance, above 0,
  // that light which does not part is said to.
  TargetClaims(const PulseShape& shape, const PulseTrain& train, const JointLikelihood& likelihood,
               double false_alarm_rate);

  // Forgets all claims but that of the first target.
  void begin(const Exposure& exposure);
  [[nodiscard]] bool is_claimed(std::size_t target) const { return is_claimed_.at(target); }
  [[nodiscard]] std::size_t count() const;
  // Claims a target that has nothing to do with the others.
  void claim(std::size_t target) { is_claimed_.at(target) = true; }
  // Claims a target of a joint fit about which the likelihood holds the photons, or does not.
  void judge(const JointParameters& at, std::size_t target);
  // Claims what stands in a row with others. The likelihood holds the photons about the fit.
  void claim_in_rows(const JointParameters& at);
  // By how many nats a target beside a brighter one is no part of that one's pulse, where
  // FlankCheck was asked.
  [[nodiscard]] std::optional<double> shape_odds_nats(std::size_t target) const {
    return shape_odds_nats_.at(target);
  }
  // How far apart two targets are over the frame, root mean square, in pulse widths.
  [[nodiscard]] double apart_widths(const TargetParameters& a, const TargetParameters& b) const;
  // What the photons say of whether two targets' lines part over the frame. The likelihood holds
  // the photons about them. Nothing is said of lines that hardly part, nor of those that are too
  // far apart to be seen as one.
  [[nodiscard]] CrossingCheck::Verdict crossing(const JointParameters& at, std::size_t one,
                                                std::size_t other) const;
  // See CrossingCheck; about a line that is near a target.
  [[nodiscard]] std::optional<DelayLine> parting_about(std::size_t target,
                                                       const TargetParameters& about,
                                                       double background_per_ns) const {
    return crossing_check_.parting_about(likelihood_.near(target), about, background_per_ns);
  }

 private:
  [[nodiscard]] bool stands_apart(const JointParameters& at, std::size_t target);
  [[nodiscard]] bool moves_beside(const JointParameters& at, std::size_t target,
                                  std::size_t bright) const;
  [[nodiscard]] bool is_beside(const JointParameters& at, std::size_t target, std::size_t bright);
  [[nodiscard]] double nats_in_flank(const JointParameters& at, std::size_t target,
                                     std::size_t bright, double side);
  [[nodiscard]] FlankCheck::Bins flank_of(const JointParameters& at, std::size_t target,
                                          std::size_t bright, double side) const;
  [[nodiscard]] double rise_again(const JointParameters& at, std::size_t target, std::size_t bright,
                                  double side, double apart_widths);
  [[nodiscard]] double rise_from(const JointParameters& at, std::size_t target, std::size_t bright,
                                 double from_widths, double to_widths);
  [[nodiscard]] bool has_nothing_behind(const JointParameters& at, std::size_t target,
                                        std::size_t other, double side, double deviations);
  struct Excess {
    double photons, deviation;
  };
  [[nodiscard]] Excess excess_beside(const JointParameters& at, std::size_t target,
                                     std::size_t other, double from_widths, double to_widths);
  [[nodiscard]] double light_of(const JointParameters& at, std::size_t target, std::size_t about,
                                double first_widths, double last_widths) const;
  // The photons within half a width of a line that is near a target.
  [[nodiscard]] double light_about(std::size_t target, DelayLine line) const;
  [[nodiscard]] bool stands_in_row(const JointParameters& at, std::size_t target) const;
  [[nodiscard]] bool falls_between(const JointParameters& at, std::size_t one,
                                   std::size_t other) const;

  const PulseShape& shape_;
  const PulseTrain& train_;
  const JointLikelihood& likelihood_;
  CrossingCheck crossing_check_;
  FlankCheck flank_check_;
  MovingLight moving_light_;
  double nats_for_moving_;
  Exposure exposure_;
  std::array<bool, most_targets> is_claimed_{};
  std::array<double, most_targets> light_{};  // about the peak of each, see claim_in_rows()
  std::array<std::optional<double>, most_targets> shape_odds_nats_{};
};

}  // namespace splid
