#include "estimator/model/pulse_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/model/chance.hpp"
#include "estimator/model/units.hpp"
#include "estimator/model/vector_level.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

class Gaussian final : public PulseShape {
 public:
  explicit Gaussian(double sigma_ns)
      : sigma_ns_(sigma_ns), peak_(1 / (sigma_ns * std::sqrt(2 * std::numbers::pi))) {}

  void evaluate(std::span<const double> offsets_ns, const ShapeValues& values) const override {
    const PulseKernels& kernels = pulse_kernels(best_vector_level());
    kernels.gaussian(values.h.data(), values.d1.data(), values.d2.data(), offsets_ns.data(),
                     1 / sigma_ns_, peak_, offsets_ns.size());
  }
  void integrate(std::span<const double> offsets_ns, std::span<double> integrals) const override {
    for (std::size_t i = 0; i < offsets_ns.size(); ++i) {
      integrals[i] = normal_integral(offsets_ns[i] / sigma_ns_);
    }
  }
  [[nodiscard]] double log_h(double offset_ns) const override {
    const double x = offset_ns / sigma_ns_;
    return std::log(peak_) - 0.5 * x * x;
  }
  [[nodiscard]] double first_ns() const override { return -reach_sigmas * sigma_ns_; }
  [[nodiscard]] double last_ns() const override { return reach_sigmas * sigma_ns_; }
  [[nodiscard]] double width_ns() const override { return sigma_ns_; }
  [[nodiscard]] double peak_offset_ns() const override { return 0; }

 private:
  static constexpr double reach_sigmas = 10;
  double sigma_ns_, peak_;
};

// Design note: the shape is a quadratic B-spline with the table as its coefficients. It is nowhere
// negative where the table is not, its integral is the table's sum times the step, and h' is
// continuous. Linear interpolation has h'' = 0 nearly everywhere, so that Newton's method would see
// no curvature at all.
class Tabulated final : public PulseShape {
 public:
  explicit Tabulated(const TabulatedPulse& table)
      : step_ns_(table.step_ps * ns_per_ps), origin_ns_(table.first_ps * ns_per_ps) {
    double sum = 0;
    for (const double density : table.density) sum += density;
    // With two zeros on either side every evaluation is a sum of three coefficients.
    coefficients_.assign(table.density.size() + 4, 0.0);
    for (std::size_t i = 0; i < table.density.size(); ++i) {
      coefficients_[i + 2] = table.density[i] / (sum * step_ns_);
    }
    sums_.assign(1, 0.0);
    for (const double value : coefficients_) sums_.push_back(sums_.back() + value * step_ns_);
    const auto peak = std::max_element(coefficients_.begin(), coefficients_.end());
    peak_offset_ns_ =
        origin_ns_ + step_ns_ * (static_cast<double>(peak - coefficients_.begin()) - 2.0);
    width_ns_ = 1 / (*peak * std::sqrt(2 * std::numbers::pi));
  }

  void evaluate(std::span<const double> offsets_ns, const ShapeValues& values) const override {
    for (std::size_t i = 0; i < offsets_ns.size(); ++i) {
      const Point p = at(offsets_ns[i]);
      values.h[i] = p.h;
      values.d1[i] = p.d1;
      values.d2[i] = p.d2;
    }
  }

  void integrate(std::span<const double> offsets_ns, std::span<double> integrals) const override {
    for (std::size_t i = 0; i < offsets_ns.size(); ++i) integrals[i] = up_to(offsets_ns[i]);
  }

  [[nodiscard]] double log_h(double offset_ns) const override {
    const double h = at(offset_ns).h;
    return h > 0 ? std::log(h) : -std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] double first_ns() const override { return origin_ns_ - 1.5 * step_ns_; }
  [[nodiscard]] double last_ns() const override {
    return origin_ns_ + (static_cast<double>(coefficients_.size()) - 4 + 0.5) * step_ns_;
  }
  [[nodiscard]] double width_ns() const override { return width_ns_; }
  [[nodiscard]] double peak_offset_ns() const override { return peak_offset_ns_; }

 private:
  struct Point {
    double h, d1, d2;
  };

  [[nodiscard]] Point at(double offset_ns) const {
    // The position is in steps, with the table's first value at 2. The piece of the spline about
    // coefficient k goes from k - 1/2 to k + 1/2.
    const double position = (offset_ns - origin_ns_) / step_ns_ + 2;
    const double nearest = std::floor(position + 0.5);
    if (!(nearest >= 1) || !(nearest <= static_cast<double>(coefficients_.size()) - 2)) {
      return {0, 0, 0};
    }
    const auto k = static_cast<std::size_t>(nearest);
    const double t = position - nearest;  // in [-1/2, 1/2)
    const double left = coefficients_[k - 1];
    const double mid = coefficients_[k];
    const double right = coefficients_[k + 1];
    const double l = 0.5 - t;
    const double r = 0.5 + t;
    const SplineWeights weights(t);
    return {weights.before * left + weights.at * mid + weights.after * right,
            (r * right - l * left - 2 * t * mid) / step_ns_,
            (left - 2 * mid + right) / (step_ns_ * step_ns_)};
  }

  // The pieces of the spline about the three coefficients that reach this offset are integrated
  // from their own begins; those before them have been passed as a whole.
  [[nodiscard]] double up_to(double offset_ns) const {
    const double position = (offset_ns - origin_ns_) / step_ns_ + 2;
    const double nearest = std::floor(position + 0.5);
    if (!(nearest >= 1)) return 0;
    if (!(nearest <= static_cast<double>(coefficients_.size()) - 2)) return 1;
    const auto k = static_cast<std::size_t>(nearest);
    const double t = position - nearest;
    const double l = 0.5 - t;
    const double r = 0.5 + t;
    const double before = 1 - l * l * l / 6;
    const double at = 0.5 + t * (0.75 - t * t / 3);
    const double after = r * r * r / 6;
    return sums_[k - 1] + step_ns_ * (before * coefficients_[k - 1] + at * coefficients_[k] +
                                      after * coefficients_[k + 1]);
  }

  double step_ns_;
  double origin_ns_;
  double width_ns_ = 0;
  double peak_offset_ns_ = 0;
  std::vector<double> coefficients_;
  std::vector<double> sums_;  // of the coefficients before each, times the step
};

}  // namespace

std::unique_ptr<PulseShape> make_gaussian(double sigma_ns) {
  return std::make_unique<Gaussian>(sigma_ns);
}

std::unique_ptr<PulseShape> make_tabulated(const TabulatedPulse& table) {
  return std::make_unique<Tabulated>(table);
}

std::unique_ptr<PulseShape> configured_pulse(const Pattern& pattern, const PulseOptions& options) {
  if (options.shape == Shape::gaussian) return make_gaussian(options.sigma_ps * ns_per_ps);
  if (!pattern.pulse) {
    throw Error(Fault::usage,
                "pulse.shape is tabulated, but the pattern file has no pulse block; calibrate the "
                "pattern or use pulse.shape gaussian");
  }
  return make_tabulated(*pattern.pulse);
}

}  // namespace splid
