#include "estimator/checks/frame_checks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/model/chance.hpp"

namespace splid::checks {
namespace {

constexpr std::size_t most_stray = 4;
constexpr int fewest_summed = 3, most_summed = 50;  // frames

}  // namespace

FrameChecks::FrameChecks(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
                         double dead_time_ns, double reach_ns)
    : train_(train),
      pulse_reach_ns_(pulse_reach_widths * shape.width_ns()),
      findings_(train, shape, max_photons, dead_time_ns),
      sums_{FindingSums(findings_), FindingSums(findings_)},
      cleaned_(train, max_photons, reach_ns) {
  sorted_.reserve(findings_.map().by_pulse().size());
  stays_.reserve(max_photons);
}

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
  const std::span<const double> counts = findings_.map().by_pulse();
  if (counts.size() < fewest_pulses) return std::nullopt;
  sorted_.assign(counts.begin(), counts.end());
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  const double usual = std::max(1.0, *middle);
  const double most = usual + sure_deviations_of_many * std::sqrt(usual);
  std::array<double, most_stray> at_ns{};
  std::size_t stray = 0;
  double photons = 0, gain_nats = 0;
  for (std::size_t p = 0; p < counts.size(); ++p) {
    if (counts[p] <= most) continue;
    if (stray == most_stray) return std::nullopt;
    at_ns[stray++] = train_.segments.front().comb.times_ns[p];
    photons += counts[p] - usual;
    gain_nats += counts[p] * std::log(counts[p] / usual) - (counts[p] - usual);
  }
  if (stray == 0) return std::nullopt;
  stays_.resize(frame.size());
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double off_ns = frame.phase_ns[i] - target.at(frame.time_ns[i] / frame.length_ns);
    const bool is_stray = std::any_of(at_ns.begin(), at_ns.begin() + stray, [&](double pulse_ns) {
      return std::abs(std::remainder(off_ns - pulse_ns, train_.period_ns)) < pulse_reach_ns_;
    });
    stays_[i] = is_stray ? 0 : 1;
  }
  const double per_s = 1e9 / frame.seen_ns;
  cleaned_.take_some(stays_, frame);
  std::swap(cleaned_, frame);
  return Finding{finding_table()[phase_row].name, photons * per_s,
                 std::sqrt(photons + 2 * usual) * per_s, gain_nats};
}

const FoundList& FrameChecks::sum_up(const FoldedFrame& frame) {
  for (FindingSums& sums : sums_) sums.add(frame);
  if (sums_.at(older_).frames() >= fewest_summed) recent_ = sums_.at(older_).found();
  if (sums_.at(1 - older_).frames() >= most_summed) {
    older_ = 1 - older_;
    sums_.at(1 - older_).clear();
  }
  return recent_;
}

}  // namespace splid::checks
