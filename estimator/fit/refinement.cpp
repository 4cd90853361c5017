#include "estimator/fit/refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace splid {
namespace {

// How far about a line photons tell how much a pulse is spread.
constexpr double spread_widths = 7;

double spread_of(const PulseShape& shape) {
  constexpr int cells = 280;
  const double first_ns = -spread_widths * shape.width_ns();
  const double step_ns = 2 * spread_widths * shape.width_ns() / cells;
  double light = 0, squares = 0;
  for (int n = 0; n < cells; ++n) {
    const double begin_ns = first_ns + n * step_ns;
    const double ends_ns[] = {shape.peak_offset_ns() + begin_ns,
                              shape.peak_offset_ns() + begin_ns + step_ns};
    double integrals[2];
    shape.integrate(ends_ns, integrals);
    const double here = integrals[1] - integrals[0];
    light += here;
    squares += here * std::pow(begin_ns + step_ns / 2, 2);
  }
  return squares / light;
}

likelihood::FreeSet free_of(bool moving) { return likelihood::free_set(1, moving ? 2 : 1); }

}  // namespace

Refinement::Refinement(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                       bool may_be_blind)
    : train_(train),
      width_ns_(shape.width_ns()),
      peak_ns_(shape.peak_offset_ns()),
      spread_ns2_(spread_of(shape)),
      maximizer_(shape, train, max_photons, {1, 1, may_be_blind}) {}

Fit Refinement::climb(const FoldedFrame& frame, DelayLine start, bool moving, double to_beat_nats,
                      bool roughly, Until until) {
  constexpr double near_top_nats = 0.1;
  maximizer_.begin(frame);
  if (until == Until::top_of_one) {
    Fit fit = fit_rates(frame, start, moving);
    if (is_of_several(fit.parameters)) {
      fit.stop = Stop::spread;
      add_covariance_of_spread(moving, fit);
      return fit;
    }
  }
  const double enough_nats =
      until == Until::near_top ? near_top_nats : likelihood::Maximizer::exact_nats;
  Fit fit = fit_of(maximizer_.maximize(model_of({start}),
                                       {free_of(moving), to_beat_nats, enough_nats, roughly}));
  if (until == Until::near_top && fit.gain_nats < to_beat_nats) fit.stop = Stop::beaten;
  return fit;
}

Fit Refinement::fit_rates(const FoldedFrame& frame, DelayLine line, bool moving) {
  maximizer_.begin(frame);
  likelihood::FreeSet rates;
  rates.set(likelihood::signal).set(likelihood::background_place(1));
  const likelihood::Maximum best = maximizer_.maximize(model_of({line}), {rates});
  return fit_of(maximizer_.judge(best.model, free_of(moving)));
}

// Whether a line comes within two widths of another one from such a share of the frame on up to
// such a share.
bool Refinement::passes_by(DelayLine line, double from, double to,
                           std::span<const DelayLine> others) const {
  constexpr double near_widths = 2;
  return std::any_of(others.begin(), others.end(), [&](DelayLine other) {
    const double apart_ns = std::remainder(line.delay_ns - other.delay_ns, train_.circle_ns);
    const double parting_ns = line.travel_ns - other.travel_ns;
    const double first_ns = apart_ns + from * parting_ns, last_ns = apart_ns + to * parting_ns;
    const auto [least, most] = std::minmax(first_ns, last_ns);
    return least < near_widths * width_ns_ && most > -near_widths * width_ns_;
  });
}

bool Refinement::is_all_along(const Fit& fit, std::span<const DelayLine> taken_out) const {
  constexpr std::size_t parts = 4;
  constexpr double half_widths = 2;
  constexpr double most_uneven = 21.1;  // chi squared of three degrees of freedom
  constexpr double least_light = 0.25;  // of the brightest part's
  constexpr std::size_t most_dark = 1;
  constexpr double least_seen = 0.9;  // of the frame: where less was seen, quarters say nothing
  const Exposure& exposure = maximizer_.likelihood().exposure();
  if (exposure.seen_ns < least_seen * exposure.length_ns * exposure.scale) return true;
  const NearSet& near = maximizer_.likelihood().near().near(0);
  const DelayLine& line = fit.parameters.line;
  const double delay_ns = line.delay_ns - near.line.delay_ns + peak_ns_;
  const double travel_ns = line.travel_ns - near.line.travel_ns;
  std::array<double, parts> photons{};
  for (std::size_t k = 0; k < near.photons(); ++k) {
    for (std::size_t j = near.first[k]; j < near.first[k + 1]; ++j) {
      const double s = near.position[j];
      const double off_ns = near.residual_ns[j] - delay_ns - travel_ns * s;
      if (std::abs(off_ns) > half_widths * width_ns_) continue;
      const auto part = static_cast<std::size_t>(std::max(0.0, (s + 0.5) * parts));
      photons[std::min(part, parts - 1)] += near.weight[k];
    }
  }
  const double mean = std::accumulate(photons.begin(), photons.end(), 0.0) / parts;
  double squares = 0;
  for (const double of_part : photons) squares += (of_part - mean) * (of_part - mean);
  if (squares <= most_uneven * mean) return true;
  const double background = fit.parameters.background_per_ns * exposure.seen_ns *
                            train_.pulses_per_ns * 2 * half_widths * width_ns_ / parts;
  const double most = *std::max_element(photons.begin(), photons.end()) - background;
  std::size_t dark = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    const double from = static_cast<double>(part) / parts - 0.5;
    dark += photons[part] - background < least_light * most &&
                    !passes_by(line, from, from + 1.0 / parts, taken_out)
                ? 1
                : 0;
  }
  return dark <= most_dark;
}

Fit Refinement::judge(const FoldedFrame& frame, const FrameParameters& at, bool moving) {
  maximizer_.begin(frame);
  return fit_of(maximizer_.judge(model_of(at), free_of(moving)));
}

// How far the photons about a line are from their mean line, wherever that is.
Refinement::Spread Refinement::spread_about(const FrameParameters& at) const {
  const NearSet& near = maximizer_.likelihood().near().near(0);
  const Exposure& exposure = maximizer_.likelihood().exposure();
  const double reach_ns = spread_widths * width_ns_;
  const double delay_ns = at.line.delay_ns - near.line.delay_ns + peak_ns_;
  const double travel_ns = at.line.travel_ns - near.line.travel_ns;
  double photons = 0, offsets = 0, turns = 0, squares = 0, fourths = 0;
  for (std::size_t k = 0; k < near.photons(); ++k) {
    for (std::size_t j = near.first[k]; j < near.first[k + 1]; ++j) {
      const double offset = near.residual_ns[j] - delay_ns - travel_ns * near.position[j];
      const double square = offset * offset;
      const double weight = std::abs(offset) < reach_ns ? near.weight[k] : 0;
      photons += weight;
      offsets += weight * offset;
      turns += weight * offset * near.position[j];
      squares += weight * square;
      fourths += weight * square * square;
    }
  }
  const double dark = at.background_per_ns * exposure.seen_ns * train_.pulses_per_ns * 2 * reach_ns;
  const double light = std::max(photons - dark, 1.0);
  const double off_line = (offsets * offsets + 12 * turns * turns) / light;
  const double own = squares - off_line - dark * reach_ns * reach_ns / 3;
  return {photons, light, own / light, (own - light * spread_ns2_) / std::sqrt(fourths)};
}

// Whether the photons about a line are spread by more than one pulse is, by four deviations of
// chance.
bool Refinement::is_of_several(const FrameParameters& at) const {
  constexpr double deviations = 4;
  return spread_about(at).deviations > deviations;
}

// The covariance of the mean line of photons that are spread as those of several targets are.
void Refinement::add_covariance_of_spread(bool moving, Fit& fit) const {
  const Spread spread = spread_about(fit.parameters);
  const Exposure& exposure = maximizer_.likelihood().exposure();
  fit.covariance.setZero();
  const double variance_ns2 = spread.mean_square_ns2 / spread.light;
  fit.covariance.diagonal() << variance_ns2, moving ? 12 * variance_ns2 : 0,
      spread.photons / (exposure.amplitude * exposure.amplitude),
      fit.parameters.background_per_ns / exposure.seen_ns;
  fit.has_covariance = true;
}

}  // namespace splid
