#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace splid {

// Where a simulated target really was, to compare estimates with, and the constants of its scene.
// JSON: schema "splid.truth".
struct SceneTruth {
  struct State {
    double distance_m = 0;    // from the lidar, without electronic_delay_ns
    double velocity_mps = 0;  // positive away from the lidar
  };

  std::int64_t start_ps = 0;         // tagger's clock at the first sample
  std::int64_t step_ps = 0;          // > 0, between samples
  std::vector<double> distance_m;    // at least one sample
  std::vector<double> velocity_mps;  // as many samples
  double signal_per_pulse = 0;       // mean detections of a pulse of amplitude 1
  double background_per_s = 0;
  double sigma_ps = 0;             // gaussian part of a detection's time
  double depth_m = 0;              // the light comes from distance_m to so much behind it
  double electronic_delay_ns = 0;  // a lidar without range offset reads c/2 times this more
  double drift_ppm = 0;            // at the stream's start
  double drift_ramp_ppm_per_s = 0;

  // A further target of the scene, with samples at the same times.
  struct Further {
    double signal_per_pulse = 0;
    std::vector<double> distance_m;
    std::vector<double> velocity_mps;
    friend bool operator==(const Further&, const Further&) = default;
  };
  std::vector<Further> more_targets;

  // A pixel of an array, with samples at the same times, or of a scan, with a sample in the middle
  // of each of its dwells.
  struct Pixel {
    std::int64_t input = 0;
    double azimuth_deg = 0;
    double elevation_deg = 0;
    double delay_ps = 0;          // of its cable; not in the distance
    double signal_per_pulse = 0;  // 0: it looks at nothing
    double background_per_s = 0;
    std::vector<double> distance_m;
    std::vector<double> velocity_mps;
    std::int64_t first_ps = 0;  // of a scan, >= 0: from start_ps to the first sample
    friend bool operator==(const Pixel&, const Pixel&) = default;
  };
  // Empty where the scene has no array. Else the samples of the scene are those of the first.
  std::vector<Pixel> pixels;
  double crosstalk_probability = 0;
  double crosstalk_ns = 0;
  std::int64_t dwell_ps = 0;  // of a scan; 0: there is none

  // The state at a time of the tagger's clock; in a scan, of the pixel in whose dwell it is.
  // Between two samples the path is a cubic that has their places and velocities. Absent before the
  // first and after the last sample, and between two lines of a scan.
  [[nodiscard]] std::optional<State> at(std::int64_t time_ps) const;
  // The same of a pixel of `pixels`.
  [[nodiscard]] std::optional<State> at(std::int64_t time_ps, const Pixel& pixel) const;

  friend bool operator==(const SceneTruth&, const SceneTruth&) = default;

 private:
  [[nodiscard]] std::optional<State> between(std::int64_t time_ps, std::int64_t first_ps,
                                             const std::vector<double>& distances_m,
                                             const std::vector<double>& velocities_mps) const;
};

// One line of JSON without a line feed, keys as the members above; start_ps, which may pass 2^53,
// is a string. Values must be finite.
std::string to_json(const SceneTruth& truth);

// Errors: Error(Fault::data) naming the member that is missing, of the wrong type or out of bounds.
SceneTruth truth_from_json(const std::string& text);

}  // namespace splid
