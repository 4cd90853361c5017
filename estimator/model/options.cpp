#include "estimator/model/options.hpp"

#include <array>
#include <string>

namespace splid {
namespace {

constexpr std::array<const char*, 2> findings_names = {"on", "off"};
constexpr std::array<const char*, 4> motion_names = {"static", "moving", "auto", "accelerating"};
constexpr std::array<const char*, 2> method_names = {"search", "paper"};
constexpr std::array<const char*, 2> effort_names = {"fast", "balanced"};
constexpr std::array<const char*, 3> drift_names = {"regression", "endpoints", "off"};
constexpr std::array<const char*, 2> reference_names = {"tagger", "pattern"};
constexpr std::array<const char*, 2> dead_time_names = {"modelled", "flagged"};
constexpr std::array<const char*, 2> shape_names = {"gaussian", "tabulated"};
constexpr std::array<const char*, 2> width_names = {"fixed", "fitted"};

}  // namespace

const char* to_string(Effort effort) { return effort_names.at(static_cast<std::size_t>(effort)); }

void SceneOptions::describe(OptionVisitor& visitor) {
  choose(
      visitor, "motion", motion, motion_names,
      "static: velocity is zero and not estimated, a frame whose target moves has status "
      "no_target; "
      "moving: always estimated; auto: estimated, and "
      "reported as zero where the photons do not ask for it, and with an acceleration where they "
      "do ask for that; accelerating: velocity and acceleration are always estimated");
  visitor.number("max_speed_mps", max_speed_mps, {0, 30000},
                 "largest speed along the line of sight that is searched, m/s");
  visitor.number(
      "max_acceleration_mps2", max_acceleration_mps2, {0, 1e5},
      "accelerating, auto: largest acceleration along the line of sight that is searched, "
      "m/s²");
  visitor.number("range_offset_m", range_offset_m, {-1e7, 1e7},
                 "subtracted from every distance: cables, fibres, electronics, m");
  visitor.integer("targets", targets, 1, static_cast<std::int64_t>(most_targets),
                  "surfaces that may send light back in one frame, as a window does before the "
                  "target; with more than 1, a frame lists all that it shows");
  visitor.flag("rigid", rigid,
               "pixels that see one rigid body share a velocity, each with its own distance; where "
               "pixels have directions, the body may turn");
  visitor.flag("pool", pool,
               "a pixel with too few photons is estimated from those of 3 x 3 pixels about it, or "
               "of 5 x 5; pixels need directions");
}

void EstimatorOptions::describe(OptionVisitor& visitor) {
  choose(visitor, "method", method, method_names,
         "search: over all delays and velocities; paper: as [P] does, for comparison, which knows "
         "neither several targets nor an acceleration");
  choose(visitor, "effort", effort, effort_names,
         "balanced: where nothing significant shows, the search looks again with finer cells; "
         "fast: it "
         "does not");
  visitor.flag("tracked", tracked,
               "a frame first looks where the one before found its target, and searches where "
               "it is not there, and every 20th frame");
  choose(visitor, "findings", findings, findings_names,
         "on: each target's light is compared with richer models, and a frame's findings name "
         "what explains it better; off: saves their time");
  visitor.number("false_alarm_rate", false_alarm_rate, {1e-12, 0.5},
                 "fraction of frames without a target that may claim one");
  visitor.number("range_risk", range_risk, {1e-12, 0.5},
                 "a frame whose range is wrong with a greater chance than this has status "
                 "ambiguous");
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
                      ", and the method of [P] knows one target",
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
         "gaussian; tabulated takes the shape that the pattern file holds");
  visitor.number("sigma_ps", sigma_ps, {1, 1e6},
                 "standard deviation of a gaussian detected pulse, ps");
  choose(visitor, "width", width, width_names,
         "fixed: as sigma_ps or the table says; fitted: the pulse's width is estimated in "
         "each frame (pulse_sigma_ps), from a quarter of the configured one to four times that");
}

std::optional<OptionFault> PulseOptions::validate(const EstimatorOptions& estimator) const {
  if (width == PulseWidth::fixed || estimator.method == Method::search) return std::nullopt;
  return OptionFault{"/width",
                     "is \"fitted\", but the method of [P] fits none; take estimator.method "
                     "\"search\", or pulse.width \"fixed\""};
}

void DetectorOptions::describe(OptionVisitor& visitor) {
  visitor.number("dead_time_ns", dead_time_ns, {0, 1e6},
                 "time after each detection in which the detector sees nothing, and which light in "
                 "that time does not prolong, ns; 0: not known");
  choose(visitor, "dead_time", dead_time, dead_time_names,
         "modelled: the estimate takes the dead time into account where it matters; flagged: "
         "frames in which the dead time would bias the result are saturated");
  visitor.pairs("walk", walk, {Bounds{0, 1e6}, Bounds{-1e4, 1e4}},
                "timing walk: waits since the detection before on the same input, ns, ascending, "
                "and by how much a detection after such a wait comes late, ps; linear in between, "
                "as in the first row before it, and nothing behind the last");
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
         "whose oscillator is the better one, and distances are in its clock: the tagger's, or the "
         "pattern's, whose period is then just what the pattern file says");
}

std::optional<OptionFault> DriftOptions::validate() const {
  if (reference != ClockReference::pattern || method != DriftMethod::off) return std::nullopt;
  return OptionFault{"/reference",
                     "is \"pattern\", which needs the pattern's period as the syncs have it, but "
                     "/drift/method is \"off\"; take \"regression\""};
}

}  // namespace splid
