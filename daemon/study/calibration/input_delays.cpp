#include "daemon/study/calibration/input_delays.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace splid::calibration {
namespace {

constexpr double sure_deviations = 5;
constexpr double least_widths = 0.05;

bool is_apart(const InputDelay& input, double width_ps) {
  return std::abs(input.shift.shift_ps) >
         std::max(sure_deviations * input.shift.std_ps, least_widths * width_ps);
}

}  // namespace

bool are_apart(const std::vector<InputDelay>& inputs, double width_ps) {
  return std::any_of(inputs.begin(), inputs.end(),
                     [&](const InputDelay& input) { return is_apart(input, width_ps); });
}

std::string describe_input_delays(const std::vector<InputDelay>& inputs, double width_ps) {
  if (!are_apart(inputs, width_ps)) return {};
  std::string text, delays;
  for (const InputDelay& input : inputs) {
    delays += (delays.empty() ? "" : ", ") +
              fmt::format("{:.1f}", input.configured_ps + input.shift.shift_ps);
    if (!is_apart(input, width_ps)) continue;
    text +=
        "input " + input.input +
        fmt::format(" has the pulses of input {} {:.1f} +- {:.1f} ps {} (alike to {:.2g} ps rms); ",
                    inputs.front().input, std::abs(input.shift.shift_ps), input.shift.std_ps,
                    input.shift.shift_ps > 0 ? "later" : "earlier", input.shift.rms_ps);
  }
  return text + "so the pattern holds each pulse once for every input: write \"delays_ps\": [" +
         delays + "] into channels of the configuration and calibrate again\n";
}

}  // namespace splid::calibration
