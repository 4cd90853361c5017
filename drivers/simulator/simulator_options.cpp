#include "drivers/simulator/simulator_options.hpp"

#include <array>
#include <filesystem>
#include <limits>
#include <string>
#include <system_error>

#include "protocol/error.hpp"

namespace splid::simulator {
namespace {

constexpr std::int64_t largest_input = 62;

constexpr std::array<const char*, 2> pace_names = {"live", "max"};

void describe_light(Options& options, OptionVisitor& visitor) {
  DetectionOptions& detection = options.detection;
  visitor.number("signal_per_pulse", detection.signal_per_pulse, {0, 1e3},
                 "mean detections of a pulse of amplitude 1; 0: no target");
  visitor.number("ambient_per_s", options.ambient_per_s, {0, 1e9},
                 "detections of daylight a second");
  visitor.number("dark_per_s", options.dark_per_s, {0, 1e9},
                 "dark counts of the detector a second");
  visitor.number("sigma_ps", detection.sigma_ps, {0, 1e6},
                 "standard deviation of a detection's time, pulse and detector together, ps");
  visitor.number("tail_fraction", detection.tail_fraction, {0, 1},
                 "fraction of the laser's detections with an exponential delay");
  visitor.number("tail_ps", detection.tail_ps, {0, 1e7}, "mean of that delay, ps");
  visitor.number("emission_jitter_ps", detection.emission_jitter_ps, {0, 1e6},
                 "standard deviation of a pulse's emission time, ps");
  visitor.number("electronic_delay_ns", detection.electronic_delay_ns, {-1e9, 1e9},
                 "delay between the sync and the detector channel, ns");
}

void describe_clocks(Options& options, OptionVisitor& visitor) {
  const double max_ppm = max_drift_ppm;
  visitor.number(
      "drift_ppm", options.drift_ppm, {-max_ppm, max_ppm},
      "pattern period in the tagger's clock divided by the calibrated period, minus 1, ppm");
  visitor.number("drift_ramp_ppm_per_s", options.drift_ramp_ppm_per_s, {-100, 100},
                 "change of the drift, ppm a second, until it is 1000 ppm either way");
  visitor.number("tagger_ppm", options.tagger_ppm, {-max_ppm, max_ppm},
                 "excess rate of the tagger's clock, ppm; delays read longer by as much");
  visitor.number("encoder_rate_hz", options.encoder_rate_hz, {0, 1e7},
                 "sample clock of an encoder on marker 1, Hz; 0: none");
  visitor.number("encoder_start_s", options.encoder_start_s, {0, 1e6},
                 "time of the encoder's first tick from the stream's start, s; splid sees a start "
                 "only after 0.1 s without ticks");
  visitor.integer("start_ps", options.start_ps, -4'000'000'000'000'000'000,
                  4'000'000'000'000'000'000, "tagger's clock at the stream's start, ps");
  visitor.integer("seed", options.seed, 0, std::numeric_limits<std::int64_t>::max(),
                  "seed of the random numbers; the same seed makes the same stream");
}

}  // namespace

void FogOptions::describe(OptionVisitor& visitor) {
  visitor.number(
      "counts_per_pulse", counts_per_pulse, {0, 1e3},
      "mean detections of a pulse of amplitude 1, from the whole depth of the fog; 0: no fog");
  visitor.number("distance_m", distance_m, {0, max_distance_m},
                 "distance at which the fog begins, m");
  visitor.number("depth_m", depth_m, {1e-3, 1e6},
                 "mean depth of the fog's returns behind distance_m, m");
}

void Options::describe(OptionVisitor& visitor) {
  visitor.object(
      "target", [this](OptionVisitor& members) { target.describe(members); },
      "where the target is");
  visitor.objects(
      "more_targets", [this](std::size_t count) { more_targets.resize(count); },
      [this](OptionVisitor& member, std::size_t i) {
        FurtherTarget placeholder;
        FurtherTarget& other = i < more_targets.size() ? more_targets[i] : placeholder;
        other.path.describe(member);
        member.number("signal_per_pulse", other.signal_per_pulse, {0, 1e3},
                      "mean detections of a pulse of amplitude 1 from this target");
      },
      more_targets.size(), "further targets, such as a window before the target");
  visitor.object(
      "fog", [this](OptionVisitor& members) { fog.describe(members); },
      "fog or haze: a smooth return without a surface");
  visitor.object(
      "foreign", [this](OptionVisitor& members) { foreign.describe(members); },
      "periodic light of another laser, or an electrical pick-up");
  describe_light(*this, visitor);
  visitor.object(
      "detector", [this](OptionVisitor& members) { detector.describe(members); },
      "properties of the detectors");
  visitor.object(
      "sync", [this](OptionVisitor& members) { sync.describe(members); },
      "the pattern's syncs as the tagger sees them");
  visitor.object(
      "array", [this](OptionVisitor& members) { array.describe(members); },
      "an array of detectors, and the surfaces before them, instead of `target`");
  visitor.object(
      "scanner", [this](OptionVisitor& members) { scanner.describe(members); },
      "a scanner: one detector that looks at the array's pixels one after another");
  describe_clocks(*this, visitor);
  visitor.number("seconds", seconds, {0, 4e6}, "length of the stream, s; 0: for ever");
  choose(visitor, "pace", pace, pace_names, "live: as time goes by; max: as fast as possible");
  visitor.path("truth", truth, "file that the true distances and velocities are written to");
  visitor.integer("photon_input", photon_input, 0, largest_input, "input number of the photons");
}

std::optional<OptionFault> Options::validate() const {
  std::optional<OptionFault> fault = target.validate();
  if (fault) {
    fault->pointer = "/target" + fault->pointer;
    return fault;
  }
  for (std::size_t i = 0; i < more_targets.size(); ++i) {
    fault = more_targets[i].path.validate();
    if (!fault) continue;
    fault->pointer = "/more_targets/" + std::to_string(i) + fault->pointer;
    return fault;
  }
  fault = detector.validate();
  if (fault) {
    fault->pointer = "/detector" + fault->pointer;
    return fault;
  }
  if (scanner.used()) {
    if (auto wrong = scanner_fault()) return wrong;
  } else if (array.used()) {
    return array_fault();
  }
  if (photon_input + detector.inputs - 1 <= largest_input) return std::nullopt;
  return OptionFault{"/detector/inputs", std::to_string(detector.inputs) +
                                             " inputs from photon_input " +
                                             std::to_string(photon_input) + " on go beyond " +
                                             std::to_string(largest_input) + ", the last input"};
}

std::optional<OptionFault> Options::array_fault() const {
  if (detector.inputs > 1) {
    return OptionFault{"/detector/inputs", "is " + std::to_string(detector.inputs) +
                                               "; each pixel of an array has one detector"};
  }
  std::optional<OptionFault> fault = array.validate(photon_input);
  if (fault) fault->pointer = "/array" + fault->pointer;
  return fault;
}

std::optional<OptionFault> Options::scanner_fault() const {
  if (!array.used()) {
    return OptionFault{"/scanner/dwell_ms",
                       "is given without directions; give source/array its "
                       "columns and rows"};
  }
  if (!array.inputs.empty() || array.crosstalk_probability > 0) {
    return OptionFault{array.inputs.empty() ? "/array/crosstalk_probability" : "/array/inputs",
                       "is given with source/scanner; a scan has one detector for all pixels"};
  }
  std::optional<OptionFault> fault = array.validate(photon_input);
  if (fault) {
    fault->pointer = "/array" + fault->pointer;
    return fault;
  }
  fault = scanner.validate(encoder_rate_hz > 0 ? 1 : 0);
  if (fault) fault->pointer = "/scanner" + fault->pointer;
  return fault;
}

std::optional<Scanner> Options::scanner_in_use() const {
  if (!scanner.used()) return std::nullopt;
  return Scanner(scanner, array.columns, array.rows);
}

std::optional<OptionFault> Options::start_fault() const {
  try {
    const PictureSurface readable(array.picture);
  } catch (const Error& error) {
    return OptionFault{"/array/picture", error.what()};
  }
  if (truth.empty()) return std::nullopt;
  const std::filesystem::path folder = std::filesystem::path(truth).parent_path();
  std::error_code unknown;  // another user may look there
  const std::filesystem::file_status there = std::filesystem::status(folder, unknown);
  if (folder.empty() || std::filesystem::is_directory(there) || !status_known(there)) {
    return std::nullopt;
  }
  return OptionFault{"/truth", truth + ": there is no folder " + folder.string() + "; make it"};
}

}  // namespace splid::simulator
