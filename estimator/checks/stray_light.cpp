#include "estimator/checks/stray_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/checks/finding.hpp"
#include "estimator/model/chance.hpp"

namespace splid::checks {
namespace {

constexpr std::size_t most_stray = 4;
// Over the median of the pulses' photons.
constexpr double stray_ratio = 4;

}  // namespace

StrayLight::StrayLight(const PulseTrain& train, double width_ns, std::size_t max_photons)
    : train_(train), reach_ns_(pulse_reach_widths * width_ns) {
  sorted_.reserve(train.single() ? train.segments.front().comb.times_ns.size() : 0);
  stays_.reserve(max_photons);
}

std::optional<Finding> StrayLight::look(const ResidualMap& map, const FoldedFrame& frame,
                                        const DelayTrack& track) {
  const std::span<const double> counts = map.by_pulse();
  if (counts.size() < fewest_pulses) return std::nullopt;
  sorted_.assign(counts.begin(), counts.end());
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  const double usual = std::max(1.0, *middle);
  const double most = stray_ratio * usual + sure_deviations_of_many * std::sqrt(usual);
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
    const double off_ns = frame.phase_ns[i] - track.at(frame.time_ns[i] / frame.length_ns);
    const bool is_stray = std::any_of(at_ns.begin(), at_ns.begin() + stray, [&](double pulse_ns) {
      return std::abs(std::remainder(off_ns - pulse_ns, train_.period_ns)) < reach_ns_;
    });
    stays_[i] = is_stray ? 0 : 1;
  }
  const double per_s = 1e9 / frame.seen_ns;
  return Finding{finding_table()[phase_row].name, photons * per_s,
                 std::sqrt(photons + 2 * usual) * per_s, gain_nats};
}

}  // namespace splid::checks
