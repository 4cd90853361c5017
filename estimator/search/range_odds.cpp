#include "estimator/search/range_odds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/model/chance.hpp"

namespace splid {
namespace {

using likelihood::Maximum;

constexpr std::size_t most_peaks = 64;

// A delay that is off by more than this is another range, as the studies count it. A range walk
// that is off by twice as much is another velocity, since its line is then as far off at the
// frame's ends.
constexpr double same_range_widths = 5;

// The width of a box that is as high as a gaussian peak and has its area (Laplace).
double spread(double variance) { return std::sqrt(2 * std::numbers::pi * variance); }

// The logarithm of the area that a gaussian peak at `at` has within +-most, over that of a box of
// the peak's height there. Fits are not held to the speeds searched: in a short frame three photons
// may look like a faster target, so that peaks beyond the largest speed lose mass, but 20 nats at
// most: a bright target that is faster than the configuration says is still found.
double share_nats(double at, double variance, double most) {
  constexpr double least_nats = -20;
  const double unit = std::sqrt(variance);
  const double inside = normal_integral((most - at) / unit) - normal_integral((-most - at) / unit);
  const double box_nats = std::log(spread(variance) / (2 * most));
  return box_nats + std::max(least_nats, std::log(inside));
}

double log_add(double a, double b) {
  const double most = std::max(a, b);
  return most + std::log1p(std::exp(std::min(a, b) - most));
}

}  // namespace

RangeOdds::RangeOdds(const SearchVolume& volume) : volume_(volume) { peaks_.reserve(most_peaks); }

// The log of a fit's Laplace volume: of delay and range walk, relative to the plane, where neither
// side can be longer than the plane's, and of the signal.
double RangeOdds::volume_nats(const Maximum& fit) const {
  if (!fit.has_covariance) return -std::numeric_limits<double>::infinity();
  constexpr auto S = static_cast<Eigen::Index>(likelihood::signal);
  const auto& C = fit.covariance;
  const double signal = std::min(spread(C(S, S)), fit.signal_per_pulse());
  double delay_variance = C(0, 0);
  double walk_nats = 0;
  if (C(1, 1) > 0 && volume_.max_walk_ns > 0) {
    // The delay's variance for a given range walk, which rounding must not make negative.
    delay_variance *= std::max(1e-12, 1 - C(0, 1) * C(0, 1) / (C(0, 0) * C(1, 1)));
    walk_nats = share_nats(fit.track().walk_ns, C(1, 1), volume_.max_walk_ns);
  }
  const double delay_share = std::min(1.0, spread(delay_variance) / volume_.period_ns);
  return std::log(signal * delay_share) + walk_nats;
}

bool RangeOdds::is_same_range(DelayTrack a, DelayTrack b) const {
  const double apart_ns = std::remainder(a.delay_ns - b.delay_ns, volume_.period_ns);
  const double most_ns = same_range_widths * volume_.width_ns;
  return std::abs(apart_ns) < most_ns && std::abs(a.walk_ns - b.walk_ns) < 2 * most_ns;
}

void RangeOdds::add(const Maximum& peak) {
  Peak added = {{peak.track(), peak.gain_nats}, std::nullopt};
  if (peak.has_covariance && peak.covariance(0, 0) > 0) added.volume_nats = volume_nats(peak);
  keep(added);
}

void RangeOdds::add(DelayTrack line, double gain_nats) { keep({{line, gain_nats}, std::nullopt}); }

void RangeOdds::keep(const Peak& peak) {
  for (Peak& other : peaks_) {
    if (!is_same_range(peak.line, other.line)) continue;
    if (peak.gain_nats > other.gain_nats) other = peak;
    return;
  }
  if (peaks_.size() < most_peaks) {
    peaks_.push_back(peak);
    return;
  }
  const auto least =
      std::min_element(peaks_.begin(), peaks_.end(),
                       [](const Peak& a, const Peak& b) { return a.gain_nats < b.gain_nats; });
  if (peak.gain_nats > least->gain_nats) *least = peak;
}

bool RangeOdds::is_one_of(DelayTrack line, std::span<const DelayTrack> lines) const {
  return std::any_of(lines.begin(), lines.end(),
                     [&](DelayTrack other) { return is_same_range(line, other); });
}

std::optional<RangeOdds::Place> RangeOdds::best_beside(std::span<const DelayTrack> lines) const {
  std::optional<Place> best;
  for (const Peak& peak : peaks_) {
    if (is_one_of(peak.line, lines)) continue;
    if (!best || peak.gain_nats > best->gain_nats) best = peak;
  }
  return best;
}

double RangeOdds::of(const Maximum& best, std::span<const DelayTrack> others) const {
  const double own_nats = volume_nats(best);
  double elsewhere = std::log(best.signal_per_pulse());  // chance
  for (const Peak& peak : peaks_) {
    if (is_same_range(peak.line, best.track()) || is_one_of(peak.line, others)) continue;
    elsewhere = log_add(elsewhere, peak.gain_nats + peak.volume_nats.value_or(own_nats));
  }
  return best.gain_nats + own_nats - elsewhere;
}

double odds_at_risk_nats(double risk) { return std::log1p(-risk) - std::log(risk); }

}  // namespace splid
