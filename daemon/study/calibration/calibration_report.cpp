#include "daemon/study/calibration/calibration_report.hpp"

#include <fmt/core.h>

#include <cmath>
#include <cstddef>

#include "daemon/base/text.hpp"
#include "daemon/study/calibration/side_lobe_report.hpp"
#include "estimator/calibration/shape_stack.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/units.hpp"
#include "protocol/json_writer.hpp"

namespace splid::calibration {
namespace {

std::string describe_range(const PatternCalibration& calibrated, double length_ms) {
  const Pattern& pattern = calibrated.pattern;
  if (pattern.mode != Mode::ambiguous) {
    const auto shape = make_tabulated(calibrated.calibration.shape);
    const std::string hardest = describe_side_lobe(pattern, *shape, length_ms);
    return hardest.empty() ? "" : hardest + "\n";
  }
  const double range_m = pattern.unambiguous_delay_ps * ns_per_ps * 1e-9 * speed_of_light_mps / 2;
  return fmt::format(
      "ranges {:.6g} m apart cannot be told apart (pulses as even as these, and the light of a "
      "frame of {:g} ms): the mode and the status of each frame are ambiguous\n",
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

}  // namespace

std::string pulse_table(const Pattern& pattern) {
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

std::string summary(const PatternCalibration& calibrated, const std::string& pattern_file,
                    double length_ms) {
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
  if (!calibrated.pattern.calibration->distance_m) {
    text += fmt::format(
        "with this pattern the target reads {:.6g} m, the middle of the range, since its distance "
        "is not known; give it with --distance-m D\n",
        calibrated.target_m);
  }
  text += describe_input_delays(calibrated.inputs, found.width_ps);
  text += describe_pixels(calibrated.pixels);
  std::vector<std::string> names;
  for (const PixelReport& pixel : calibrated.pixels) names.push_back(pixel.name);
  text += describe_crosstalk(calibrated.crosstalk, names);
  text += "to measure with it, write into the configuration: \"pattern\":{\"file\":\"" +
          pattern_file + "\"},\"pulse\":{\"shape\":\"tabulated\"}\n";
  return text;
}

PhotonDensity photon_density(const PatternCalibration& calibrated) {
  FoldModel model = model_of(calibrated.fold, calibrated.calibration);
  const StackedPhotons stack = stack_photons(model);
  const double scale = 1 / (calibrated.calibration.signal_photons * stack.step_ps * ns_per_ps);
  PhotonDensity all;
  for (std::size_t j = 0; j < stack.net.size(); ++j) {
    all.offset_ps.push_back(stack.offset_ps(j));
    all.density_per_ns.push_back(stack.net[j] * scale);
    all.std_per_ns.push_back(std::sqrt(stack.variance[j]) * scale);
  }
  return all;
}

std::string photon_density_csv(const PatternCalibration& calibrated) {
  const PhotonDensity all = photon_density(calibrated);
  std::string text = "offset_ps,density_per_ns,std_per_ns\n";
  for (std::size_t j = 0; j < all.offset_ps.size(); ++j) {
    text += number_text(all.offset_ps[j]) + ',' + number_text(all.density_per_ns[j]) + ',' +
            number_text(all.std_per_ns[j]) + '\n';
  }
  return text;
}

}  // namespace splid::calibration
