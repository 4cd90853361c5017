#include "estimator/array/shared_fit.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/model/units.hpp"

namespace splid::array {
namespace {

constexpr int most_rounds = 8;
// A step of so many deviations is the last one. Newton's next one would have about its square.
constexpr double short_step = 0.03;

// The first `terms` rows and columns.
std::optional<TermsMatrix> inverse_of(const TermsMatrix& information, Eigen::Index terms) {
  const SmallMatrix block = information.topLeftCorner(terms, terms);
  const std::optional<SmallMatrix> inverse = inverse_of_positive(block);
  if (!inverse) return std::nullopt;
  TermsMatrix whole = TermsMatrix::Zero();
  whole.topLeftCorner(terms, terms) = *inverse;
  return whole;
}

}  // namespace

SharedFit::SharedFit(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
                     double reach_ns)
    : train_(train),
      frame_(train, max_photons, reach_ns),
      maximizer_(shape, train, max_photons, {}) {}

SharedMaximum SharedFit::fit(std::span<SharedPixel> pixels, Eigen::Index terms,
                             const Terms& start) {
  SharedMaximum best;
  best.terms = start;
  for (int round = 0; round < most_rounds; ++round) {
    Sums sums;
    for (SharedPixel& pixel : pixels) add(pixel, best.terms, sums);
    const std::optional<TermsMatrix> covariance = inverse_of(sums.information, terms);
    best.has_covariance = covariance.has_value();
    if (!covariance) return best;
    best.covariance = *covariance;
    const std::optional<TermsMatrix> all = inverse_of(sums.information, most_terms);
    best.more_nats = all ? sums.slope.dot(*all * sums.slope) / 2 : 0;
    const Terms step = *covariance * sums.slope;
    const double deviations = std::sqrt(std::max(0.0, step.dot(sums.slope)));
    best.terms += step;
    if (deviations < short_step) break;
  }
  return best;
}

// The pixel's maximum at its velocity, and how its likelihood falls off beside it.
void SharedFit::add(SharedPixel& pixel, const Terms& at, Sums& sums) {
  constexpr auto W = static_cast<Eigen::Index>(likelihood::walk);
  const double mps = at.dot(pixel.row);
  const FrameView still = at_rest(*pixel.frame, mps);
  frame_.fold(still, train_);
  maximizer_.begin(frame_);
  likelihood::Model model;
  model.add({{pixel.delay_ns, 0, 0}, pixel.signal_per_pulse});
  model.background_per_ns = pixel.background_per_ns;
  const likelihood::Maximum there = maximizer_.maximize(model, {likelihood::free_set(1, 1)});
  const likelihood::FreeSet moving = likelihood::free_set(1, 2);
  const likelihood::Maximum judged = maximizer_.judge(there.model, moving);
  pixel.gain_nats = judged.gain_nats;
  if (!judged.has_covariance || !(judged.covariance(W, W) > 0)) return;
  pixel.delay_ns = there.model.targets[0].track.delay_ns;
  pixel.signal_per_pulse = there.model.targets[0].signal_per_pulse;
  pixel.background_per_ns = there.model.background_per_ns;
  maximizer_.likelihood().evaluate(there.model, moving, point_);
  // d walk / d v, with g = 2 beta / (1 + beta).
  const double beta = mps / speed_of_light_mps;
  const double per_mps = 2 * frame_.length_ns /
                         (speed_of_light_mps * (1 + beta) * (1 + beta) * (1 - walk_ns_at(mps, 1)));
  const Terms row = per_mps * pixel.row;
  sums.information += row * row.transpose() / judged.covariance(W, W);
  sums.slope += row * point_.gradient[W];
}

}  // namespace splid::array
