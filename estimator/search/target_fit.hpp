#pragma once

#include <cstddef>
#include <optional>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/options.hpp"
#include "estimator/search/frame_search.hpp"

namespace splid {

// A target that a look has found, fitted with what the scene asks for.
struct FittedTarget {
  Start start;
  likelihood::Maximum best;
  std::size_t track_terms = 2;  // free: delay, range walk, quadratic term
  double threshold_nats = 0;
  double odds_nats = 0;  // of the range
  bool is_target = false;
};

// Fits what a look has found: the path at rest, straight or curved as the scene says (motion
// `auto`: as the photons say), and the pulse's width where it is asked for.
class TargetFit {
 public:
  static constexpr double most_width = 4;  // widths are fitted up to 4 times the configured width

  TargetFit(FrameSearch& search, const PulseShape& shape, const PulseTrain& train, Motion motion,
            bool is_width_fitted, bool may_be_dead, std::size_t max_photons);

  [[nodiscard]] FittedTarget fit(Look look, const Start& start, const FoldedFrame& frame);

 private:
  void fit_path(Look look, FittedTarget& target);
  void fit_richer_path(Look look, FittedTarget& target);
  void fit_width(FittedTarget& target);
  [[nodiscard]] likelihood::Maximum maximum_with(const likelihood::Model& model,
                                                 std::size_t track_terms, bool width_too = false);

  FrameSearch& search_;
  std::optional<likelihood::Maximizer> wide_;  // where the width is fitted
  Motion motion_;
  double width_ns_;
  const FoldedFrame* frame_ = nullptr;
};

}  // namespace splid
