#include "estimator/checks/pulse_check.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "estimator/checks/chi_squared.hpp"
#include "estimator/likelihood/small_matrix.hpp"

namespace splid {
namespace {

constexpr double bins_a_pulse_width = 2;
constexpr double most_reach_widths = 8;
constexpr double most_fitted_reach_widths = 16;
constexpr double nearest_reach_widths = 4;

// Design note: with 40 photons the width is known to 11 %, so that a pulse must be 1.7 times as
// wide as the configured one to be noticed. Fewer photons notice nothing worth saying.
constexpr double fewest_photons = 40;
constexpr double least_score = 6;   // squared deviations from which on the two models are fitted
constexpr double least_ratio = 24;  // twice the gain in nats: chance reaches it in 1e-6 of frames
// Differences of the width below 2 % move no value by as much as its deviation, but where pulses
// hide their late light: there the place moves, by this of its deviations or more.
constexpr double least_width_misfit = 0.02;
constexpr double least_moved = 0.5;

constexpr double widest_ratio = 4;
constexpr int most_scorings = 25;
// Of the groups that a fitted gaussian's counts are judged in.
constexpr double fewest_in_group = 8;
constexpr double least_group_widths = 0.8;
constexpr double surely_skew = 3;  // deviations from which on the skewness is believed

// The least background: a tenth of a photon in all bins together, so that a photon far from the
// pulse does not forbid a model.
constexpr double least_in_all_bins = 0.1;

// The order of the parameters: the pulse's light, the background of a bin, the shift of the pulse,
// and the logarithm of its width.
enum PulseParameter { by_light, by_background, by_shift, by_log_width, pulse_parameters };

}  // namespace

void PulseMisfit::widen(Estimate& estimate, double width_ns, double amplitude_per_ns) const {
  estimate.pulse_misfit = width_ratio - 1;
  const double wider = std::max(1.0, width_ratio);
  const double spread_ns = width_ns * std::sqrt(wider * wider - 1);
  estimate.std_delay_ns = std::hypot(estimate.std_delay_ns * wider, spread_ns, shift_ns);
  estimate.std_velocity_mps *= wider;
  estimate.std_acceleration_mps2 *= wider;
  const double missed = (signal_ratio - 1) * estimate.signal_per_pulse;
  estimate.std_signal_per_pulse = std::hypot(estimate.std_signal_per_pulse, missed);
  estimate.std_background_per_ns =
      std::hypot(estimate.std_background_per_ns, missed * amplitude_per_ns);
}

void ShapeVerdict::widen(Estimate& estimate, double configured_ns, double fitted_ns,
                         double amplitude_per_ns) const {
  estimate.pulse_skew = skew;
  estimate.std_pulse_skew = std_skew;
  estimate.shape_misfit = misfit;
  if (!misfit) return;
  const double spread_ns =
      std::sqrt(std::max(0.0, fitted_ns * fitted_ns - configured_ns * configured_ns));
  const bool is_skew = std::abs(skew) > surely_skew * std_skew;
  const double off_ns = is_skew ? fitted_ns * std::cbrt(std::abs(skew) / 2) : 0;
  estimate.std_delay_ns = std::hypot(estimate.std_delay_ns, std::max(spread_ns, off_ns));
  const double missed = (signal_ratio - 1) * estimate.signal_per_pulse;
  estimate.std_signal_per_pulse = std::hypot(estimate.std_signal_per_pulse, missed);
  estimate.std_background_per_ns =
      std::hypot(estimate.std_background_per_ns, missed * amplitude_per_ns);
}

// The frame as a whole tells the background, so that a bin's is known to a tenth: light beside the
// pulse is not background. Only a detector that is blind after photons sees a background that
// changes with the phase.
//
// Design note: with a free background a second surface four widths behind was taken for a high
// background about the pulse.
struct PulseCheck::Known {
  double background = 0;  // photons in a bin
  HidingLight hiding;
  [[nodiscard]] double std_background() const {
    return (hiding.count > 0 ? 1.0 : 0.1) * background;
  }
  [[nodiscard]] double deviations(double of_background) const {
    return (of_background - background) / std_background();
  }
};

struct PulseCheck::Model {
  double light = 0;       // photons of the pulse, in and beyond the bins
  double background = 0;  // photons in a bin
  double shift_ns = 0;    // of the pulse
  double ratio = 1;       // of its width to the configured one
};

// The expected counts, and their derivatives in the order of PulseParameter.
struct PulseCheck::Expected {
  std::array<double, most_bins> count;
  std::array<Eigen::Vector4d, most_bins> by;
  // The derivative by light that hides the more what comes later the more it is.
  std::array<double, most_bins> by_hiding_light;
  double unseen = 0, unseen_by_light = 0;  // pulses of which nothing is seen
};

PulseCheck::PulseCheck(const PulseShape& shape, double closest_ns, bool is_fitted) : shape_(shape) {
  const double width_ns = shape.width_ns();
  const double most_widths = is_fitted ? most_fitted_reach_widths : most_reach_widths;
  const double reach_ns = std::min(most_widths * width_ns, 0.499 * closest_ns);
  if (reach_ns < nearest_reach_widths * width_ns) return;
  bins_ = static_cast<std::size_t>(std::floor(2 * reach_ns / width_ns * bins_a_pulse_width + 1e-9));
  bin_ns_ = 2 * reach_ns / static_cast<double>(bins_);
  bins_per_ns_ = 1 / bin_ns_;
  first_ns_ = shape.peak_offset_ns() - reach_ns;
  last_ns_ = shape.peak_offset_ns() + reach_ns;
}

// What is seen of the light and of the background where the first photon of a pulse hides the
// others: of each bin, and of the light that comes at each edge.
struct PulseCheck::Seen {
  std::array<double, most_bins> light{}, background{};
  std::array<double, most_bins> by_light{};  // of what is seen, where all light is more
  std::array<double, most_bins + 1> at_edge{};
  double unseen = 0, unseen_by_light = 0;  // pulses of which nothing is seen, over all light
};

// integral: of the pulse's light, up to each edge.
//
// Design note: the detector that is alive with the probability a sees n h + b photons a ns, and is
// blind after each: a falls by that and rises by the dead times that end. These matter where the
// detector is blind for most of the time: at three photons a pulse, and as many of background in a
// dead time, those that end within a pulse make its light 1 % wider. Half of a bin's are taken to
// end at its begin, and half at its end.
void PulseCheck::see(const HidingLight& hiding, std::span<const double> integral,
                     Seen& seen) const {
  if (hiding.count == 0) {
    for (std::size_t j = 0; j < bins_; ++j) seen.light[j] = integral[j + 1] - integral[j];
    seen.by_light = seen.light;
    seen.background.fill(1);
    seen.at_edge.fill(1);
    return;
  }
  const double of_light = 1 / hiding.light(), of_all = 1 / hiding.pulses();
  const double dark = hiding.background_per_ns;
  for (const HidingLight::Kind& kind : std::span(hiding.kinds).first(hiding.count)) {
    const double wakes = kind.wakes_per_ns;
    const double awake = wakes * bin_ns_ / 2, kept = 1 - dark * bin_ns_ / 2;
    double alive = std::max(0.0, 1 + (dark - wakes) * (shape_.peak_offset_ns() - first_ns_));
    double by_light = 0;  // of `alive`
    for (std::size_t j = 0; j < bins_; ++j) {
      seen.at_edge[j] += kind.pulses * kind.photons * alive * of_light;
      const double photons = kind.photons * (integral[j + 1] - integral[j]);
      const double before = alive * kept + awake;
      const double left = before * std::exp(-photons);
      const double left_by_light = by_light * kept * std::exp(-photons) - photons * left;
      seen.light[j] += kind.pulses * (before - left) * of_light;
      seen.by_light[j] += kind.pulses * (by_light * kept - left_by_light) * of_light;
      seen.background[j] += kind.pulses * (before + left) / 2 * of_all;
      alive = left * kept + awake;
      by_light = left_by_light * kept;
    }
    seen.at_edge[bins_] += kind.pulses * kind.photons * alive * of_light;
    seen.unseen += kind.pulses * alive * of_light;
    seen.unseen_by_light += kind.pulses * by_light * of_light;
  }
}

void PulseCheck::expect(const Model& model, const HidingLight& hiding, Expected& expected) const {
  std::array<double, most_bins + 1> offset{}, h{}, d1{}, d2{}, integral{};
  const std::size_t edges = bins_ + 1;
  const double peak_ns = shape_.peak_offset_ns();
  for (std::size_t i = 0; i < edges; ++i) {
    const double at_ns = first_ns_ + static_cast<double>(i) * bin_ns_;
    offset[i] = peak_ns + (at_ns - peak_ns - model.shift_ns) / model.ratio;
  }
  const std::span<const double> offsets(offset.data(), edges);
  shape_.evaluate(offsets, {h, d1, d2});
  shape_.integrate(offsets, integral);
  Seen seen;
  see(hiding, {integral.data(), edges}, seen);
  double before_shift = 0, before_width = 0;
  for (std::size_t i = 0; i < edges; ++i) {
    const double d_shift = -seen.at_edge[i] * h[i] / model.ratio;
    const double d_width = -seen.at_edge[i] * h[i] * (offset[i] - peak_ns);
    if (i > 0) {
      const double part = seen.light[i - 1], flat = seen.background[i - 1];
      expected.count[i - 1] = model.light * part + model.background * flat;
      expected.by[i - 1] = {part, flat, model.light * (d_shift - before_shift),
                            model.light * (d_width - before_width)};
    }
    before_shift = d_shift;
    before_width = d_width;
  }
  expected.by_hiding_light = seen.by_light;
  expected.unseen = hiding.light() * seen.unseen;
  expected.unseen_by_light = seen.unseen_by_light;
}

double PulseCheck::log_likelihood(const Expected& expected) const {
  double sum = 0;
  for (std::size_t j = 0; j < bins_; ++j) {
    if (counts_[j] > 0) sum += counts_[j] * std::log(expected.count[j]);
    sum -= expected.count[j];
  }
  return sum;
}

// Fisher's scoring for the first so many parameters, with shorter steps where a step loses. Returns
// the log-likelihood.
double PulseCheck::climb(Model& model, const Known& known, int parameters) const {
  Expected expected;
  const auto value_of = [&](const Model& at) {
    expect(at, known.hiding, expected);
    return log_likelihood(expected) - std::pow(known.deviations(at.background), 2) / 2;
  };
  double best = value_of(model);
  const double floor = least_in_all_bins / static_cast<double>(bins_);
  for (int round = 0; round < most_scorings; ++round) {
    Eigen::Vector4d score = Eigen::Vector4d::Zero();
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    for (std::size_t j = 0; j < bins_; ++j) {
      score += (counts_[j] / expected.count[j] - 1) * expected.by[j];
      information += expected.by[j] * expected.by[j].transpose() / expected.count[j];
    }
    const double std_background = known.std_background();
    score[by_background] -= known.deviations(model.background) / std_background;
    information(by_background, by_background) += 1 / (std_background * std_background);
    for (int k = parameters; k < pulse_parameters; ++k) {
      information.row(k).setZero();
      information.col(k).setZero();
      information(k, k) = 1;
      score[k] = 0;
    }
    Eigen::Vector4d step = solution_of_semidefinite(information, score);
    if (!step.allFinite()) return best;
    const double too_long = std::max(std::abs(step[by_shift]) / (shape_.width_ns() * model.ratio),
                                     std::abs(step[by_log_width]) / 0.3);
    if (too_long > 1) step /= too_long;
    double gained = 0;
    for (int halving = 0; halving < 8; ++halving) {
      Model next = model;
      next.light = std::max(model.light / 4, model.light + step[by_light]);
      next.background = std::max(floor, model.background + step[by_background]);
      next.shift_ns += step[by_shift];
      next.ratio =
          std::clamp(model.ratio * std::exp(step[by_log_width]), 1 / widest_ratio, widest_ratio);
      const double value = value_of(next);
      gained = value - best;
      if (gained > 0) {
        model = next;
        best = value;
        break;
      }
      step /= 2;
    }
    if (!(gained > 1e-3)) break;
  }
  return best;
}

// The step of the width from the configured one, with the other parameters free.
PulseVerdict PulseCheck::step_of_width(const Expected& expected, const Known& known) const {
  Eigen::Vector4d score = Eigen::Vector4d::Zero();
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  for (std::size_t j = 0; j < bins_; ++j) {
    score += (counts_[j] / expected.count[j] - 1) * expected.by[j];
    information += expected.by[j] * expected.by[j].transpose() / expected.count[j];
  }
  information(by_background, by_background) += 1 / std::pow(known.std_background(), 2);
  const Eigen::Vector3d cross = information.col(by_log_width).head<3>();
  Eigen::Matrix<double, 3, 2> right;
  right << score.head<3>(), cross;
  const Eigen::Matrix<double, 3, 2> others =
      solution_of_semidefinite(information.topLeftCorner<3, 3>(), right);
  const double left = score[by_log_width] - cross.dot(others.col(0));
  const double variance = information(by_log_width, by_log_width) - cross.dot(others.col(1));
  if (!(variance > 0)) return {};
  return {left / variance, 1 / std::sqrt(variance), {}};
}

// The configured pulse with all light that the background does not explain.
PulseCheck::Model PulseCheck::model_of_counts(double background_in_bin) const {
  double all = 0;
  for (std::size_t j = 0; j < bins_; ++j) all += counts_[j];
  const auto bins = static_cast<double>(bins_);
  Model model;
  model.background = std::max(background_in_bin, least_in_all_bins / bins);
  model.light = all - model.background * bins;
  return model;
}

PulseVerdict PulseCheck::judge(double background_in_bin, const HidingLight& hiding) const {
  if (!looks()) return {};
  Model configured = model_of_counts(background_in_bin);
  if (configured.light < fewest_photons) return {};
  const Known known = {configured.background, hiding};
  Expected expected;
  expect(configured, hiding, expected);
  if (hiding.count > 0) {
    double shown = 0;
    for (std::size_t j = 0; j < bins_; ++j) shown += expected.by[j][by_light];
    configured.light /= shown;
    expect(configured, hiding, expected);
  }
  PulseVerdict verdict = step_of_width(expected, known);
  if (std::pow(verdict.excess, 2) < least_score * std::pow(verdict.std_excess, 2)) return verdict;
  const double with_configured = climb(configured, known, by_log_width);
  Model another = configured;
  const double with_another = climb(another, known, pulse_parameters);
  if (!(2 * (with_another - with_configured) >= least_ratio)) return verdict;
  const Pull pull = pull_of_width(configured, hiding);
  PulseMisfit misfit = {another.ratio, another.light / configured.light,
                        another.shift_ns - configured.shift_ns};
  if (hiding.count > 0) {
    const double wider = std::log(another.ratio);
    misfit.signal_ratio = 1 - pull.light * wider;
    misfit.shift_ns = -pull.shift_ns * wider;
  }
  const bool does_move = std::abs(misfit.shift_ns) >= least_moved * pull.std_shift_ns;
  if (does_move || std::abs(another.ratio - 1) >= least_width_misfit) verdict.misfit = misfit;
  return verdict;
}

// The likelihood of a frame knows what the fits to the counts here do not: that the light which
// hides is the one that is seen, and how many pulses there are of which nothing is seen. With three
// photons a pulse most of what it knows of the light are these.
//
// Design note: of such pulses one in 20 stays dark. So fits that know that too took a detector that
// is blind for a thousandth of the time more or less than was said for one of another pulse width.
PulseCheck::Pull PulseCheck::pull_of_width(const Model& model, const HidingLight& hiding) const {
  Expected expected;
  expect(model, hiding, expected);
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  for (std::size_t j = 0; j < bins_; ++j) {
    Eigen::Vector4d by = expected.by[j];
    by[by_light] = expected.by_hiding_light[j];
    information += by * by.transpose() / expected.count[j];
  }
  if (hiding.count > 0) {
    information(by_light, by_light) +=
        expected.unseen_by_light * expected.unseen_by_light / expected.unseen;
  }
  information(by_background, by_background) += 1 / std::pow(0.1 * model.background, 2);
  Eigen::Matrix<double, 3, 2> right;
  right << information.col(by_log_width).head<3>(), Eigen::Vector3d::Unit(by_shift);
  const Eigen::Matrix<double, 3, 2> moved =
      solution_of_semidefinite(information.topLeftCorner<3, 3>(), right);
  return {moved(by_light, 0) / model.light, moved(by_shift, 0), std::sqrt(moved(by_shift, 1))};
}

// Neighbouring bins are put together. Counts of 8 and more have deviances of chi squared; a sum of
// squares would have a longer tail.
PulseCheck::Deviance PulseCheck::deviance(const Expected& expected, double ratio) const {
  const double least_bins = least_group_widths * ratio * shape_.width_ns() * bins_per_ns_;
  Deviance all;
  double left = 0;
  for (std::size_t j = 0; j < bins_; ++j) left += expected.count[j];
  double seen = 0, due = 0, bins = 0;
  for (std::size_t j = 0; j < bins_; ++j) {
    seen += counts_[j], due += expected.count[j], bins += 1;
    left -= expected.count[j];
    const bool is_full = due >= fewest_in_group && bins >= least_bins && left >= fewest_in_group;
    if (!is_full && j + 1 < bins_) continue;
    all.value += 2 * ((seen > 0 ? seen * std::log(seen / due) : 0) - (seen - due));
    ++all.groups;
    seen = due = bins = 0;
  }
  return all;
}

// A gaussian h of the skewness g is h (1 + g / 6 (u^3 - 3 u)), by Gram and Charlier, with the
// integral -g / 6 (u^2 - 1) h up to u.
void PulseCheck::step_to_skew(const Expected& expected, const Model& model, const Known& known,
                              ShapeVerdict& verdict) const {
  std::array<double, most_bins + 1> offset{}, h{}, d1{}, d2{};
  const std::size_t edges = bins_ + 1;
  const double peak_ns = shape_.peak_offset_ns();
  for (std::size_t i = 0; i < edges; ++i) {
    const double at_ns = first_ns_ + static_cast<double>(i) * bin_ns_;
    offset[i] = peak_ns + (at_ns - peak_ns - model.shift_ns) / model.ratio;
  }
  shape_.evaluate({offset.data(), edges}, {h, d1, d2});
  Eigen::Vector4d cross = Eigen::Vector4d::Zero();
  Eigen::Vector4d scores = Eigen::Vector4d::Zero();
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  double score = 0, own = 0, before = 0;
  for (std::size_t i = 0; i < edges; ++i) {
    const double u = (offset[i] - peak_ns) / shape_.width_ns();
    const double integral = -model.light * (u * u - 1) * h[i] * shape_.width_ns() / 6;
    if (i > 0) {
      const double by = integral - before;
      const double count = expected.count[i - 1];
      const Eigen::Vector4d& others = expected.by[i - 1];
      const double off = counts_[i - 1] / count - 1;
      score += off * by;
      scores += off * others;
      own += by * by / count;
      cross += by / count * others;
      information += others * others.transpose() / count;
    }
    before = integral;
  }
  scores[by_background] -= known.deviations(model.background) / known.std_background();
  information(by_background, by_background) += 1 / std::pow(known.std_background(), 2);
  Eigen::Matrix<double, 4, 2> right;
  right << scores, cross;
  const Eigen::Matrix<double, 4, 2> others = solution_of_semidefinite(information, right);
  const double variance = own - cross.dot(others.col(1));
  const double left = score - cross.dot(others.col(0));
  if (!(variance > 0) || !std::isfinite(left / variance)) return;
  verdict.skew = left / variance;
  verdict.std_skew = 1 / std::sqrt(variance);
}

ShapeVerdict PulseCheck::judge_shape(double background_in_bin, double ratio) const {
  ShapeVerdict verdict;
  if (!looks()) return verdict;
  Model model = model_of_counts(background_in_bin);
  const double light = model.light;
  model.ratio = std::clamp(ratio, 1 / widest_ratio, widest_ratio);
  if (model.light < fewest_photons) return verdict;
  const Known known = {model.background, {}};
  climb(model, known, pulse_parameters);
  Expected expected;
  expect(model, {}, expected);
  step_to_skew(expected, model, known, verdict);
  const Deviance found = deviance(expected, model.ratio);
  constexpr int fitted = 2;  // of the four parameters, those that the groups surely tell
  const double degrees = found.groups - fitted;
  if (degrees < 2) return verdict;
  if (found.value / degrees < million_of_chi_squared(degrees)) return verdict;
  verdict.misfit = std::sqrt((found.value - degrees) / model.light);
  verdict.signal_ratio = std::max(0.0, light) / model.light;
  return verdict;
}

}  // namespace splid
