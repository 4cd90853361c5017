#include "estimator/checks/finding.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid::checks {
namespace {

constexpr Direction wider[] = {{Shape::width, 0, 0}};
constexpr Direction tailed[] = {{Shape::tail, 0, 0}};
constexpr Direction beside[] = {{Shape::early, 0, 0}, {Shape::late, 0, 0}};
constexpr Direction curved_path[] = {{Shape::path, 2, 2}};
constexpr Direction turning[] = {{Shape::path, 3, 3}};
constexpr Direction swinging[] = {{Shape::path, 4, 31}};
constexpr Direction uneven[] = {{Shape::light, 1, 7}};
constexpr Direction parting[] = {{Shape::width, 1, 2}};

constexpr bool changes_sign = false;  // from frame to frame

double itself(double amount, const FindingScale& /*scale*/) { return amount; }
double grown(double amount, const FindingScale& /*scale*/) { return std::expm1(amount); }
double a_second(double amount, const FindingScale& scale) { return amount / scale.seen_ns * 1e9; }
double to_mps2(double eps_ns, const FindingScale& scale) {
  return acceleration_of(eps_ns, scale.length_ns);
}
// A delay of eps P_3(u) ns has the third derivative 120 eps / t_a^3. Distance is half of delay.
double to_mps3(double eps_ns, const FindingScale& scale) {
  return 60e18 * speed_of_light_mps * eps_ns / std::pow(scale.length_ns, 3);
}
double to_mm(double eps_ns, const FindingScale& /*scale*/) {
  return eps_ns * speed_of_light_mps * 1e-6 / 2;
}

constexpr std::array table = {
    FindingRow{FindingName::pulse_width, "", grown,
               "Calibrate the pulse, set pulse.sigma_ps, or fit pulse.width.", wider},
    FindingRow{FindingName::pulse_tail, "", itself,
               "Calibrate the pulse and set pulse.shape to tabulated, or allow more scene.targets.",
               tailed},
    FindingRow{FindingName::unmodelled_light, "photons/s", a_second,
               "Allow more scene.targets, or keep foreign light and haze out of the beam.", beside},
    FindingRow{FindingName::acceleration, "m/s2", to_mps2,
               "Set scene.motion to accelerating or auto, or shorten frame.length_ms.", curved_path,
               changes_sign},
    FindingRow{FindingName::jerk, "m/s3", to_mps3,
               "Shorten frame.length_ms, so that the acceleration is constant over a frame.",
               turning, changes_sign},
    FindingRow{FindingName::vibration, "mm", to_mm,
               "Shorten frame.length_ms to less than half a period of the vibration.", swinging,
               changes_sign},
    FindingRow{FindingName::fading, "", itself,
               "Shorten frame.length_ms, or look for what blocks or dims the beam.", uneven,
               changes_sign},
    FindingRow{FindingName::pulse_width, "", grown,
               "Set scene.targets to 2: the light is that of two targets that part.", parting},
    FindingRow{FindingName::unmodelled_light, "photons/s", a_second,
               "Allow more scene.targets, or keep foreign light and pick-up out of the detector."},
    FindingRow{FindingName::pulse_amplitudes, "", itself,
               "Calibrate the pattern's amplitudes and set pattern.file to the result."},
    FindingRow{FindingName::wrong_pattern, "", itself,
               "Set pattern.file to the pattern that the generator plays."},
    FindingRow{FindingName::dead_time, "ns", itself, "Set detector.dead_time_ns to this time."},
    FindingRow{FindingName::afterpulsing, "", itself,
               "Lengthen the detector's hold-off, and set detector.dead_time_ns to it."},
    FindingRow{FindingName::timing_walk, "ps", itself,
               "Set detector.walk to the waits and delays of the detector."},
};

}  // namespace

std::span<const FindingRow> finding_table() { return table; }

Finding FindingRow::found(double in_unit, double gain_nats) const {
  return {name, in_unit, std::abs(in_unit) / std::sqrt(2 * gain_nats), gain_nats};
}

const FindingRow& row_of(FindingName name) {
  return *std::find_if(table.begin(), table.end(), [&](const auto& r) { return r.name == name; });
}

const char* to_string(FindingName name) {
  static constexpr std::array names = {
      "pulse_width",   "pulse_tail", "unmodelled_light", "acceleration",
      "jerk",          "vibration",  "fading",           "pulse_amplitudes",
      "wrong_pattern", "dead_time",  "afterpulsing",     "timing_walk"};
  static_assert(names.size() == finding_names);
  return names.at(static_cast<std::size_t>(name));
}

}  // namespace splid::checks
