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
constexpr Direction bent[] = {{Shape::path, 2, 2}};
constexpr Direction turning[] = {{Shape::path, 3, 3}};
constexpr Direction swinging[] = {{Shape::path, 4, 31}};
constexpr Direction uneven[] = {{Shape::light, 1, 7}};
constexpr Direction parting[] = {{Shape::width, 1, 2}};

double itself(double amount, const FindingScale& /*scale*/) { return amount; }
double grown(double amount, const FindingScale& /*scale*/) { return std::expm1(amount); }
double a_second(double amount, const FindingScale& scale) { return amount / scale.seen_ns * 1e9; }
// A delay of eps P_2(u) ns has the second derivative 12 eps / t_a^2, and one of eps P_3(u) the
// third derivative 120 eps / t_a^3. Distance is half of delay.
double to_mps2(double eps_ns, const FindingScale& scale) {
  return 6e9 * speed_of_light_mps * eps_ns / (scale.length_ns * scale.length_ns);
}
double to_mps3(double eps_ns, const FindingScale& scale) {
  return 60e18 * speed_of_light_mps * eps_ns / std::pow(scale.length_ns, 3);
}
double to_mm(double eps_ns, const FindingScale& /*scale*/) {
  return eps_ns * speed_of_light_mps * 1e-6 / 2;
}

constexpr std::array table = {
    FindingRow{FindingName::pulse_width, "", wider, grown, true,
               "Calibrate the pulse, set pulse.sigma_ps, or fit pulse.width."},
    FindingRow{
        FindingName::pulse_tail, "", tailed, itself, true,
        "Calibrate the pulse and set pulse.shape to tabulated, or allow more scene.targets."},
    FindingRow{FindingName::unmodelled_light, "photons/s", beside, a_second, true,
               "Allow more scene.targets, or keep foreign light and haze out of the beam."},
    FindingRow{FindingName::acceleration, "m/s2", bent, to_mps2, false,
               "Set scene.motion to accelerating or auto, or shorten frame.length_ms."},
    FindingRow{FindingName::jerk, "m/s3", turning, to_mps3, false,
               "Shorten frame.length_ms, so that the acceleration is constant over a frame."},
    FindingRow{FindingName::vibration, "mm", swinging, to_mm, false,
               "Shorten frame.length_ms to less than half a period of the vibration."},
    FindingRow{FindingName::fading, "", uneven, itself, false,
               "Shorten frame.length_ms, or look for what blocks or dims the beam."},
    FindingRow{FindingName::pulse_width, "", parting, grown, true,
               "Set scene.targets to 2: the light is that of two targets that part."},
    FindingRow{FindingName::unmodelled_light,
               "photons/s",
               {},
               a_second,
               true,
               "Allow more scene.targets, or keep foreign light and pick-up out of the detector."},
    FindingRow{FindingName::pulse_amplitudes,
               "",
               {},
               itself,
               true,
               "Calibrate the pattern's amplitudes and set pattern.file to the result."},
    FindingRow{FindingName::wrong_pattern,
               "",
               {},
               itself,
               true,
               "Set pattern.file to the pattern that the generator plays."},
    FindingRow{
        FindingName::dead_time, "ns", {}, itself, true, "Set detector.dead_time_ns to this time."},
    FindingRow{FindingName::afterpulsing,
               "",
               {},
               itself,
               true,
               "Lengthen the detector's hold-off, and set detector.dead_time_ns to it."},
    FindingRow{FindingName::timing_walk,
               "ps",
               {},
               itself,
               true,
               "Set detector.walk to the waits and delays of the detector."},
};

}  // namespace

std::span<const FindingRow> finding_table() { return table; }

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
