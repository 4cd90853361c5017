#include "estimator/fit/refinement.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimator/likelihood/small_matrix.hpp"

namespace splid {
namespace {

constexpr int max_rounds = 40;
constexpr double margin_widths = 4;
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

struct Derivatives {
  Eigen::Vector2d slope;
  Eigen::Matrix2d curvature;  // of -l, with S and b at their best: positive definite on a hill
};

// The derivatives by (delay, travel) of the likelihood whose S and b stay at their best as the line
// moves.
Derivatives profile_derivatives(const LikelihoodPoint& point, const FrameParameters& at) {
  Derivatives d;
  d.slope = point.gradient.head<2>();
  d.curvature = -point.hessian.topLeftCorner<2, 2>();
  // In units of S and b themselves, so that the small matrix is well conditioned.
  const Eigen::Vector2d unit(at.signal_per_pulse, at.background_per_ns);
  Eigen::Matrix2d rates =
      -(unit.asDiagonal() * point.hessian.bottomRightCorner<2, 2>() * unit.asDiagonal());
  const Eigen::Matrix2d cross = -(point.hessian.topRightCorner<2, 2>() * unit.asDiagonal());
  const double trace = rates.trace();
  if (!(trace > 0)) return d;
  rates += Eigen::Matrix2d::Identity() * (1e-12 * trace);
  const double det = rates.determinant();
  if (det > 0) d.curvature -= cross * rates.inverse() * cross.transpose();
  return d;
}

// Newton's step up the hill; where the surface is no hill, a step up the slope. No side of the step
// is longer than longest_ns.
Eigen::Vector2d step_of(const Derivatives& d, bool moving, double longest_ns) {
  Eigen::Vector2d step = Eigen::Vector2d::Zero();
  if (!moving) {
    const double curvature = std::max(d.curvature(0, 0), std::abs(d.slope[0]) / longest_ns);
    if (curvature > 0) step[0] = d.slope[0] / curvature;
    return step;
  }
  Eigen::Matrix2d curvature = d.curvature;
  const double floor = d.slope.norm() / longest_ns + 1e-30;
  // Where an eigenvalue is not clearly positive, both are lifted so that the step stays short.
  // Those of a hill are left as they are.
  const double mean = curvature.trace() / 2;
  const double spread = std::hypot((curvature(0, 0) - curvature(1, 1)) / 2, curvature(0, 1));
  const double least = mean - spread;
  if (least < floor * 1e-3) curvature += Eigen::Matrix2d::Identity() * (floor - least);
  step = curvature.inverse() * d.slope;
  const double length = step.cwiseAbs().maxCoeff();
  if (length > longest_ns) step *= longest_ns / length;
  return step;
}

// The most that is left to gain on a hill: three times what its parabola says, and 10 nats. There
// is no limit where the surface is no hill.
//
// Design note: this hill flattens on its way down, into the background, so that a parabola says
// rather too much than too little. The factor of three is for hills of few photons.
double most_to_gain_nats(const Derivatives& d, bool moving) {
  constexpr double some_nats = 10;
  double gain = 0;
  if (moving) {
    const auto step = solution_of_positive(d.curvature, d.slope);
    if (!step) return std::numeric_limits<double>::infinity();
    gain = d.slope.dot(*step) / 2;
  } else {
    if (!(d.curvature(0, 0) > 0)) return std::numeric_limits<double>::infinity();
    gain = d.slope[0] * d.slope[0] / d.curvature(0, 0) / 2;
  }
  return 3 * gain + some_nats;
}

}  // namespace

Refinement::Refinement(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                       bool may_be_blind)
    : train_(train),
      width_ns_(shape.width_ns()),
      peak_ns_(shape.peak_offset_ns()),
      spread_ns2_(spread_of(shape)),
      margin_ns_(margin_widths * shape.width_ns()),
      windows_(
          comb_windows(train, shape.first_ns() - 2 * margin_ns_, shape.last_ns() + 2 * margin_ns_)),
      near_(max_photons, max_photons * widest_overlap(windows_)),
      likelihood_(shape, max_photons * widest_overlap(windows_)) {
  if (may_be_blind) blind_.emplace(shape, max_photons, max_photons * widest_overlap(windows_));
}

void Refinement::collect(const FoldedFrame& frame, DelayLine about, double gather_width_ns,
                         std::size_t gather_from) {
  near_.collect(frame, windows_, train_, about, gather_width_ns, gather_from);
  const bool is_blind = blind_ && frame.blind != nullptr;
  if (is_blind) blind_->collect(frame, near_, windows_, train_, gather_width_ns);
  likelihood_.leave_out(is_blind ? &*blind_ : nullptr);
}

Fit Refinement::climb(const FoldedFrame& frame, const Exposure& exposure, DelayLine start,
                      bool moving, double to_beat_nats, bool roughly, Until until) {
  const Way way = {frame, exposure, moving, to_beat_nats, until};
  Fit fit = climb_gathered(way, start, NearSet::gathered_roughly_from);
  const bool is_exact = !near_.gathers || near_.likely_near >= NearSet::gathered_from;
  if (fit.stop == Stop::spread) {
    add_covariance_of_spread(exposure, moving, fit);
    return fit;
  }
  if (!is_exact && !roughly && fit.stop != Stop::beaten) {
    fit = climb_gathered(way, fit.parameters.line, NearSet::gathered_from);
  }
  if (until == Until::near_top && fit.gain_nats < to_beat_nats) fit.stop = Stop::beaten;
  if (fit.stop != Stop::beaten) add_covariance(exposure, moving, fit);
  return fit;
}

Fit Refinement::climb_gathered(const Way& way, DelayLine start, std::size_t gather_from) {
  Fit fit;
  for (int collected = 0; collected < 8; ++collected) {
    collect(way.frame, start, width_ns_, gather_from);
    fit = climb_within(way, start);
    if (fit.stop == Stop::beaten) return fit;
    const DelayLine& line = fit.parameters.line;
    // The ends of the line move by half of what its travel changes.
    const double moved =
        std::abs(line.delay_ns - start.delay_ns) + std::abs(line.travel_ns - start.travel_ns) / 2;
    if (moved <= margin_ns_) break;
    start = line;
  }
  return fit;
}

Fit Refinement::fit_rates(const FoldedFrame& frame, const Exposure& exposure, DelayLine line,
                          bool moving) {
  collect(frame, line, width_ns_, NearSet::gathered_roughly_from);
  const Likelihood::Profile profile = likelihood_.profile(near_, exposure, line);
  Fit fit;
  fit.parameters = profile.parameters;
  fit.gain_nats = profile.gain_nats;
  add_covariance(exposure, moving, fit);
  return fit;
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

bool Refinement::is_all_along(const Exposure& exposure, const Fit& fit,
                              std::span<const DelayLine> taken_out) const {
  constexpr std::size_t parts = 4;
  constexpr double half_widths = 2;
  constexpr double most_uneven = 21.1;  // chi squared of three degrees of freedom
  constexpr double least_light = 0.25;  // of the brightest part's
  constexpr std::size_t most_dark = 1;
  constexpr double least_seen = 0.9;  // of the frame: where less was seen, quarters say nothing
  if (exposure.seen_ns < least_seen * exposure.length_ns * exposure.scale) return true;
  const DelayLine& line = fit.parameters.line;
  const double delay_ns = line.delay_ns - near_.line.delay_ns + peak_ns_;
  const double travel_ns = line.travel_ns - near_.line.travel_ns;
  std::array<double, parts> photons{};
  for (std::size_t k = 0; k < near_.photons(); ++k) {
    for (std::size_t j = near_.first[k]; j < near_.first[k + 1]; ++j) {
      const double s = near_.position[j];
      const double off_ns = near_.residual_ns[j] - delay_ns - travel_ns * s;
      if (std::abs(off_ns) > half_widths * width_ns_) continue;
      const auto part = static_cast<std::size_t>(std::max(0.0, (s + 0.5) * parts));
      photons[std::min(part, parts - 1)] += near_.weight[k];
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

Fit Refinement::judge(const FoldedFrame& frame, const Exposure& exposure, const FrameParameters& at,
                      bool moving) {
  collect(frame, at.line, 0, NearSet::gathered_from);
  Fit fit;
  fit.parameters = at;
  const double all = static_cast<double>(near_.far_photons) + near_.near_photons;
  const double no_target = all * std::log(all / exposure.seen_ns) - all;
  fit.gain_nats = likelihood_.evaluate(near_, exposure, at).value - no_target;
  if (std::isfinite(fit.gain_nats)) add_covariance(exposure, moving, fit);
  return fit;
}

// How far the photons about a line are from their mean line, wherever that is.
Refinement::Spread Refinement::spread_about(const Exposure& exposure,
                                            const FrameParameters& at) const {
  const double reach_ns = spread_widths * width_ns_;
  const double delay_ns = at.line.delay_ns - near_.line.delay_ns + peak_ns_;
  const double travel_ns = at.line.travel_ns - near_.line.travel_ns;
  double photons = 0, offsets = 0, turns = 0, squares = 0, fourths = 0;
  for (std::size_t k = 0; k < near_.photons(); ++k) {
    for (std::size_t j = near_.first[k]; j < near_.first[k + 1]; ++j) {
      const double offset = near_.residual_ns[j] - delay_ns - travel_ns * near_.position[j];
      const double square = offset * offset;
      const double weight = std::abs(offset) < reach_ns ? near_.weight[k] : 0;
      photons += weight;
      offsets += weight * offset;
      turns += weight * offset * near_.position[j];
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
bool Refinement::is_of_several(const Way& way, const FrameParameters& at) const {
  constexpr double deviations = 4;
  return way.until == Until::top_of_one && spread_about(way.exposure, at).deviations > deviations;
}

// The covariance of the mean line of photons that are spread as those of several targets are.
void Refinement::add_covariance_of_spread(const Exposure& exposure, bool moving, Fit& fit) const {
  const Spread spread = spread_about(exposure, fit.parameters);
  const double variance_ns2 = spread.mean_square_ns2 / spread.light;
  fit.covariance.diagonal() << variance_ns2, moving ? 12 * variance_ns2 : 0,
      spread.photons / (exposure.amplitude * exposure.amplitude),
      fit.parameters.background_per_ns / exposure.seen_ns;
  fit.has_covariance = true;
}

Fit Refinement::climb_within(const Way& way, DelayLine start) {
  constexpr double enough_nats = 0.1;
  constexpr double short_step_widths = 0.25;
  const Exposure& exposure = way.exposure;
  const bool moving = way.moving;
  Fit fit;
  Likelihood::Profile best = likelihood_.profile(near_, exposure, start);
  if (is_of_several(way, best.parameters)) {
    fit.parameters = best.parameters;
    fit.gain_nats = best.gain_nats;
    fit.stop = Stop::spread;
    return fit;
  }
  const double step_small = 1e-6 * width_ns_;
  const double gain_small = 1e-10;
  fit.stop = Stop::rounds_spent;
  bool is_loaded = true;  // the likelihood still holds the shape values of the best line
  for (int round = 0; round < max_rounds; ++round) {
    const LikelihoodPoint point = likelihood_.evaluate(near_, exposure, best.parameters, is_loaded);
    const Derivatives derivatives = profile_derivatives(point, best.parameters);
    if (best.gain_nats + most_to_gain_nats(derivatives, moving) < way.to_beat_nats) {
      fit.stop = Stop::beaten;
      break;
    }
    Eigen::Vector2d step = step_of(derivatives, moving, width_ns_);
    Likelihood::Profile next;
    double gained = 0;
    for (int halving = 0; halving < 30; ++halving) {
      const DelayLine line = {best.parameters.line.delay_ns + step[0],
                              best.parameters.line.travel_ns + step[1]};
      next = likelihood_.profile(near_, exposure, line, best.signal_fraction);
      gained = next.gain_nats - best.gain_nats;
      if (gained > -gain_small || step.cwiseAbs().maxCoeff() < step_small) break;
      step *= 0.5;
    }
    // Near the top Newton's step is right even where rounding makes it gain a little less than 0.
    is_loaded = gained > -gain_small;
    if (is_loaded) best = next;
    const double length_ns = step.cwiseAbs().maxCoeff();
    const bool small = length_ns < step_small;
    const bool is_near = gained < enough_nats && length_ns < short_step_widths * width_ns_;
    if (small || gained < gain_small || (is_near && way.until == Until::near_top)) {
      fit.stop = small ? Stop::step_small : Stop::gain_small;
      break;
    }
    const double moved = std::abs(best.parameters.line.delay_ns - start.delay_ns) +
                         std::abs(best.parameters.line.travel_ns - start.travel_ns) / 2;
    if (moved > margin_ns_) break;  // collect anew
  }
  fit.parameters = best.parameters;
  fit.gain_nats = best.gain_nats;
  return fit;
}

void Refinement::add_covariance(const Exposure& exposure, bool moving, Fit& fit) {
  const LikelihoodPoint point = likelihood_.evaluate(near_, exposure, fit.parameters);
  // Where no photon speaks for a background, the likelihood falls as exp(-b t), so that the unit of
  // b is then 1 / t.
  const double b_unit = std::max(fit.parameters.background_per_ns, 1 / exposure.seen_ns);
  const bool no_background = fit.parameters.background_per_ns * exposure.seen_ns < 1e-6;
  const Eigen::Vector4d unit(width_ns_, width_ns_, fit.parameters.signal_per_pulse, b_unit);
  Eigen::Matrix4d information = -(unit.asDiagonal() * point.hessian * unit.asDiagonal());
  if (!moving) {
    information.row(travel_index).setZero();
    information.col(travel_index).setZero();
    information(travel_index, travel_index) = 1;
  }
  if (no_background) {
    information.row(background_index).setZero();
    information.col(background_index).setZero();
    information(background_index, background_index) = 1;
  }
  const auto inverse = inverse_of_positive(information);
  if (!inverse) return;
  fit.covariance = unit.asDiagonal() * *inverse * unit.asDiagonal();
  if (!moving) fit.covariance(travel_index, travel_index) = 0;
  fit.has_covariance = fit.covariance.allFinite();
}

}  // namespace splid
