#include "estimator/checks/frame_checks.hpp"

#include <cmath>
#include <utility>

namespace splid::checks {

FrameChecks::FrameChecks(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
                         double dead_time_ns, double reach_ns)
    : findings_(train, shape, max_photons, dead_time_ns),
      sums_{FindingSums(findings_), FindingSums(findings_)},
      stray_(train, shape.width_ns(), max_photons),
      cleaned_(train, max_photons, reach_ns) {}

// The first target comes last, so that its residual map is there to be summed up.
std::array<Verdict, most_targets> FrameChecks::judge(const FrameView& view,
                                                     const FoldedFrame& frame,
                                                     const likelihood::Maximum& fitted,
                                                     std::size_t track_terms) {
  std::array<Verdict, most_targets> verdicts;
  const SeenParts parts = seen_parts(view);
  for (std::size_t k = fitted.model.count; k-- > 0;) {
    const auto std_of = [&](likelihood::OfTarget parameter) {
      const auto i = static_cast<Eigen::Index>(likelihood::place_of(k, parameter));
      return std::sqrt(fitted.covariance(i, i));
    };
    const FitFacts facts = {track_terms, fitted.model.log_width != 0, std_of(likelihood::delay),
                            std_of(likelihood::walk), std_of(likelihood::quadratic)};
    verdicts.at(k) = findings_.judge(frame, fitted.model, k, facts, parts);
  }
  return verdicts;
}

std::optional<Finding> FrameChecks::take_stray_light(FoldedFrame& frame, const DelayTrack& target) {
  const std::optional<Finding> finding = stray_.look(findings_.map(), frame, target);
  if (finding) {
    cleaned_.take_some(stray_.stays(), frame);
    std::swap(cleaned_, frame);
  }
  return finding;
}

void FrameChecks::put_back(FoldedFrame& frame) { std::swap(cleaned_, frame); }

const FoundList& FrameChecks::sum_up(const FoldedFrame& frame) {
  constexpr double fewest = 3, most = 50;
  for (FindingSums& sums : sums_) sums.add(frame);
  if (sums_.at(older_).frames() >= fewest) recent_ = sums_.at(older_).found();
  if (sums_.at(1 - older_).frames() >= most) {
    older_ = 1 - older_;
    sums_.at(1 - older_).clear();
  }
  return recent_;
}

}  // namespace splid::checks
