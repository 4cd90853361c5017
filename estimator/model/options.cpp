#include "estimator/model/options.hpp"

#include <array>
#include <string>

namespace splid {
namespace {

constexpr std::array findings_names = {"on", "off"};
constexpr std::array motion_names = {"static", "moving", "auto", "accelerating"};
constexpr std::array method_names = {"search", "paper"};
constexpr std::array effort_names = {"fast", "balanced"};
constexpr std::array drift_names = {"regression", "endpoints", "off"};
constexpr std::array reference_names = {"tagger", "pattern"};
constexpr std::array dead_time_names = {"modelled", "flagged"};
constexpr std::array shape_names = {"gaussian", "tabulated"};
constexpr std::array width_names = {"fixed", "fitted"};

}  // namespace

const char* to_string(Effort effort) { return effort_names.at(static_cast<std::size_t>(effort)); }

void SceneOptions::describe(OptionVisitor& visitor) {
  choose(visitor, "motion", motion, motion_names,
         "static: velocity is zero, and a frame whose target moves is no_target; moving: velocity "
         "is estimated; accelerating: velocity and acceleration are estimated; auto: each of them "
         "only in frames that show it");
  visitor.number("max_speed_mps", max_speed_mps, {0, 30000},
                 "largest speed along the line of sight that the search covers, m/s");
  visitor.number("max_acceleration_mps2", max_acceleration_mps2, {0, 1e5},
                 "accelerating, auto: largest acceleration along the line of sight that the search "
                 "covers, m/s²");
  visitor.number("range_offset_m", range_offset_m, {-1e7, 1e7},
                 "offset of cables, fibres and electronics, subtracted from every distance, m");
  visitor.integer("targets", targets, 1, static_cast<std::int64_t>(most_targets),
                  "largest number of targets in a frame, such as a window and what is behind it; "
                  "with more than 1, frames list their targets");
  visitor.flag("rigid", rigid,
               "pixels that see the same rigid body share a velocity; a body seen by pixels with "
               "directions may turn");
  visitor.flag("pool", pool,
               "a pixel with too few photons takes those of the 3 x 3 or 5 x 5 pixels about it; "
               "pixels need directions");
}

void EstimatorOptions::describe(OptionVisitor& visitor) {
  choose(visitor, "method", method, method_names,
         "search: over all delays and velocities; paper: the method of [P], for comparison, "
         "without several targets and acceleration");
  choose(visitor, "effort", effort, effort_names,
         "balanced: a frame without a significant target is searched again with finer cells; fast: "
         "once only");
  visitor.flag("tracked", tracked,
               "a frame first tries the target of the frame before; it is searched if the target "
               "is not there, and every 20 frames");
  choose(visitor, "findings", findings, findings_names,
         "on: richer models are tried on each target's photons, and findings name those that "
         "explain them better; off: saves that time");
  visitor.number("false_alarm_rate", false_alarm_rate, {1e-12, 0.5},
                 "fraction of frames without a target that may report a target");
  visitor.number("range_risk", range_risk, {1e-12, 0.5},
                 "a frame whose range is wrong with a greater probability is ambiguous");
}

// Motion automatic goes with the method of [P]: the photons decide whether the target moves, and no
// acceleration is looked for.
std::optional<OptionFault> EstimatorOptions::validate(const SceneOptions& scene) const {
  if (method == Method::search) return std::nullopt;
  const auto refuse = [](const std::string& what, const std::string& instead) {
    return OptionFault{"/method", "is \"paper\", but " + what +
                                      "; take estimator.method \"search\", or " + instead};
  };
  if (scene.targets > 1) {
    return refuse("scene.targets is " + std::to_string(scene.targets) +
                      ", and the method of [P] has one target",
                  "scene.targets 1");
  }
  if (scene.motion == Motion::accelerating) {
    return refuse("scene.motion is \"accelerating\", and the method of [P] knows no acceleration",
                  "scene.motion \"moving\"");
  }
  return std::nullopt;
}

void PulseOptions::describe(OptionVisitor& visitor) {
  choose(visitor, "shape", shape, shape_names,
         "gaussian, or tabulated: the shape in the pattern file");
  visitor.number("sigma_ps", sigma_ps, {1, 1e6},
                 "standard deviation of a Gaussian detected pulse (laser, detector, tagger), ps");
  choose(visitor, "width", width, width_names,
         "fixed: the configured width; fitted: each frame estimates the width (pulse_sigma_ps), "
         "from a quarter to four times the configured width");
}

std::optional<OptionFault> PulseOptions::validate(const EstimatorOptions& estimator) const {
  if (width == PulseWidth::fixed || estimator.method == Method::search) return std::nullopt;
  return OptionFault{
      "/width",
      "is \"fitted\", but the method of [P] does not fit the width; take estimator.method "
      "\"search\", or pulse.width \"fixed\""};
}

void DetectorOptions::describe(OptionVisitor& visitor) {
  visitor.number("dead_time_ns", dead_time_ns, {0, 1e6},
                 "dead time of the detector after each detection, which light does not prolong, "
                 "ns; 0: not known");
  choose(visitor, "dead_time", dead_time, dead_time_names,
         "modelled: the likelihood has the dead time, where it matters; flagged: frames that the "
         "dead time biases are saturated");
  visitor.pairs("walk", walk, {Bounds{0, 1e6}, Bounds{-1e4, 1e4}},
                "timing walk, rows of [wait, delay]: wait since the last detection on the same "
                "input, ns, ascending, and delay of the detection after it, ps; linear in between, "
                "constant below the first row, 0 above the last");
}

std::optional<OptionFault> DetectorOptions::validate() const {
  constexpr std::size_t most_rows = 16;
  if (walk.size() > most_rows) {
    return OptionFault{"/walk", "has " + std::to_string(walk.size()) + " rows; at most " +
                                    std::to_string(most_rows) + " are allowed"};
  }
  for (std::size_t i = 1; i < walk.size(); ++i) {
    if (walk[i][0] > walk[i - 1][0]) continue;
    return OptionFault{"/walk/" + std::to_string(i) + "/0",
                       "is " + std::to_string(walk[i][0]) + " ns; must be above the wait before, " +
                           std::to_string(walk[i - 1][0]) + " ns"};
  }
  return std::nullopt;
}

void DriftOptions::describe(OptionVisitor& visitor) {
  choose(
      visitor, "method", method, drift_names,
      "regression: line through all syncs; endpoints: first and last sync (Eq. 19, 20); off: the "
      "calibrated period");
  choose(visitor, "reference", reference, reference_names,
         "clock with the better oscillator, which distances are measured in: the tagger's, or the "
         "pattern generator's, with the period in the pattern file");
}

std::optional<OptionFault> DriftOptions::validate() const {
  if (reference != ClockReference::pattern || method != DriftMethod::off) return std::nullopt;
  return OptionFault{"/reference",
                     "is \"pattern\", which needs the pattern's period as the syncs have it, but "
                     "/drift/method is \"off\"; take \"regression\""};
}

}  // namespace splid
