#include "daemon/study/calibration/calibration_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include "daemon/base/text.hpp"
#include "daemon/study/calibration/look_alike_report.hpp"
#include "estimator/calibration/shape_stack.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double per_ns = 1 / ns_per_ps;  // converts a density per ps

// For a pattern whose pulse times contain the way to the target.
std::string describe_wrap(const Pattern& pattern) {
  const double range_m = pattern.unambiguous_delay_ps * ns_per_ps * 1e-9 * speed_of_light_mps / 2;
  return fmt::format(
      "distances will be relative to this target, which itself reads 0 or, as the noise has it, "
      "just below {:.6g} m, where they wrap; --distance-m D gives it a place\n",
      range_m);
}

std::string describe_range(const PatternCalibration& calibrated, double length_ms) {
  const Pattern& pattern = calibrated.pattern;
  if (pattern.mode != Mode::ambiguous) {
    const auto shape = make_tabulated(calibrated.calibration.shape);
    const std::string hardest = describe_look_alike(pattern, *shape, length_ms);
    return hardest.empty() ? "" : hardest + "\n";
  }
  const double range_m = pattern.unambiguous_delay_ps * ns_per_ps * 1e-9 * speed_of_light_mps / 2;
  return fmt::format(
      "ranges {:.6g} m apart cannot be told apart (pulses as even as these, and the light of a "
      "frame of {:g} ms): mode ambiguous, each frame says so\n",
      range_m, length_ms);
}

std::string describe_rest(const RestReport& rest) {
  if (rest.frames < 3) {
    return grouped(rest.frames) + " frames are too few to see whether the target was at rest";
  }
  std::string text =
      fmt::format("target at rest: {:+.2g} +- {:.2g} ps/s over {:.3g} s", rest.delay_rate_ps_per_s,
                  rest.std_delay_rate_ps_per_s, rest.seconds);
  if (rest.moves()) text += " (it moves, but by less than the times are known to)";
  if (rest.wanders()) text += fmt::format("; it wanders by {:.2g} ps rms", rest.wander_ps);
  return text;
}

// The stacked photons as a density, each value with the noise of its photon count.
ChartSeries photons_of(const StackedPhotons& stack, double all, ChartRange range) {
  ChartSeries series{"photons of all pulses, background removed",
                     "#1f5fa8",
                     Marker::circle,
                     false,
                     LineStyle::none,
                     {}};
  const double scale = per_ns / (all * stack.step_ps);
  for (std::size_t j = 0; j < stack.net.size(); ++j) {
    const double at_ps = stack.offset_ps(j);
    if (at_ps < range.low || at_ps > range.high) continue;
    const double std = std::sqrt(stack.variance[j]) * scale;
    const double value = stack.net[j] * scale;
    series.points.push_back({at_ps, value, {}, ChartRange{value - std, value + std}});
  }
  return series;
}

ChartSeries line_of(const PulseShape& shape, const std::string& label, const std::string& color,
                    LineStyle style, ChartRange range) {
  constexpr int points = 400;
  ChartSeries series{label, color, Marker::none, false, style, {}};
  std::vector<double> at_ns(points + 1), h(points + 1), d1(points + 1), d2(points + 1);
  for (std::size_t i = 0; i <= points; ++i) {
    const double part = static_cast<double>(i) / points;
    at_ns[i] = (range.low + part * (range.high - range.low)) * ns_per_ps;
  }
  shape.evaluate(at_ns, {h, d1, d2});
  for (std::size_t i = 0; i <= points; ++i) {
    series.points.push_back({at_ns[i] / ns_per_ps, h[i], {}, {}});
  }
  return series;
}

}  // namespace

std::string calibration_table(const Pattern& pattern) {
  const PatternSegment& segment = pattern.segments.front();
  const CalibrationFacts& facts = *pattern.calibration;
  std::string text = fmt::format("{:>5}  {:>14}  {:>7}  {:>9}  {:>7}\n", "pulse", "time ps", "+-",
                                 "amplitude", "+-");
  for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
    text +=
        fmt::format("{:5}  {:>14.2f}  {:>7.2f}  {:>9.4f}  {:>7.4f}\n", p, segment.pulse_times_ps[p],
                    facts.std_pulse_times_ps[p], segment.amplitudes[p], facts.std_amplitudes[p]);
  }
  return text;
}

std::string calibration_summary(const PatternCalibration& calibrated,
                                const std::string& pattern_file, double length_ms) {
  const Calibration& found = calibrated.calibration;
  const TabulatedPulse& shape = found.shape;
  const auto last = static_cast<double>(shape.density.size() - 1);
  std::string text = pattern_file + ": " + describe_pattern(calibrated.pattern) + "\n";
  text += grouped(static_cast<std::uint64_t>(found.signal_photons)) + " signal photons of " +
          grouped(found.photons) + fmt::format(" in {:.4g} s; ", found.seconds) +
          describe_rest(calibrated.rest) + "\n";
  text +=
      fmt::format("calibrated period {:.9f} +- {:.2g} ps\n", found.period_ps, found.std_period_ps);
  text += fmt::format(
      "pulse: {:.4g} ps wide (gaussian of the same peak), table from {:.4g} to {:.4g} ps in "
      "steps of {:.3g} ps{}\n",
      found.width_ps, shape.first_ps, shape.first_ps + last * shape.step_ps, shape.step_ps,
      found.settled ? ""
                    : "; it did not settle: pulses may be closer than the table "
                      "is long");
  text += describe_range(calibrated, length_ms);
  if (!calibrated.pattern.calibration->distance_m) text += describe_wrap(calibrated.pattern);
  text += describe_input_delays(calibrated.inputs, found.width_ps);
  text += "to measure with it, write into the configuration: \"pattern\":{\"file\":\"" +
          pattern_file + "\"},\"pulse\":{\"shape\":\"tabulated\"}\n";
  return text;
}

Chart calibration_chart(const PatternCalibration& calibrated, const CalibrationPlan& plan,
                        double sigma_ps) {
  const Calibration& found = calibrated.calibration;
  FoldModel model = model_of(calibrated.fold, found);
  const StackedPhotons stack = stack_photons(model);
  const auto shape = make_tabulated(found.shape);
  const auto gaussian = make_gaussian(sigma_ps * ns_per_ps);
  const double margin_ps = 2 * found.width_ps;
  const ChartRange range{shape->first_ns() / ns_per_ps - margin_ps,
                         shape->last_ns() / ns_per_ps + margin_ps};
  const std::vector<ChartSeries> series = {
      photons_of(stack, found.signal_photons, range),
      line_of(*shape, "calibrated shape", "#c0392b", LineStyle::solid, range),
      line_of(*gaussian, fmt::format("gaussian of {:g} ps", sigma_ps), "#777", LineStyle::dashed,
              range)};
  const double peak = 1 / (found.width_ps * ns_per_ps * std::sqrt(2 * std::numbers::pi));
  // The logarithmic axis goes down to a tenth of the density of a single photon in a step.
  const double least = 0.1 * per_ns / (found.signal_photons * stack.step_ps);
  Chart chart{"The pulse of " + plan.recording,
              fmt::format("{} pulses, ", found.pulses.size()) +
                  grouped(static_cast<std::uint64_t>(found.signal_photons)) + " signal photons",
              {}};
  const ChartAxis offset{"after the pulse's time, ps", false, range};
  chart.panels.push_back({"", offset, {"density, 1/ns", false, std::nullopt}, series});
  chart.panels.push_back(
      {"",
       offset,
       {"density, 1/ns", true, ChartRange{std::max(least, 1e-6 * peak), 2 * peak}},
       series});
  return chart;
}

}  // namespace splid
