#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "drivers/simulator/emission.hpp"
#include "drivers/simulator/fine_time.hpp"
#include "drivers/simulator/pending_times.hpp"
#include "drivers/simulator/random.hpp"
#include "drivers/simulator/scanner.hpp"
#include "drivers/simulator/target_path.hpp"

namespace splid::simulator {

// How a laser photon becomes a detection.
struct DetectionOptions {
  double signal_per_pulse = 13.5e-4;  // mean detections of a pulse of amplitude 1
  double sigma_ps = 100;              // gaussian, pulse and detector together
  double tail_fraction = 0;           // of the detections, which an exponential delay is added to
  double tail_ps = 0;                 // mean of that delay
  double emission_jitter_ps = 0;      // gaussian, the same for all photons of a pulse
  double electronic_delay_ns = 0;     // between sync and detector channels
  double fog_m = 0;                   // mean way that light goes on behind the target: FogOptions
};

// What light meets that leaves in one direction.
struct Sight {
  TargetPath path;
  double signal_per_pulse = 0;  // mean detections of a pulse of amplitude 1
};

// The detections of laser light, also of pulses that left before the stream's start.
//
// Threads: one. No allocation once the fullest stretch has passed.
class SignalStream {
 public:
  // target: which of the scene's targets, from 0; each draws random numbers of its own.
  SignalStream(const Pattern& pattern, const DetectionOptions& options, DriftRate drift,
               TargetPath motion, std::uint64_t seed, std::uint64_t target = 0);
  // Of a scan. pixels: what the scanner looks at, in the place of the options' signal_per_pulse.
  SignalStream(const Pattern& pattern, const DetectionOptions& options, DriftRate drift,
               std::vector<Sight> pixels, const Scanner& scanner, std::uint64_t seed);

  // Makes all detections before until_ps available in pending(), and some later detections.
  void fill(std::int64_t until_ps);
  PendingTimes& pending() { return pending_; }

 private:
  [[nodiscard]] bool dark() const {
    return !(options_.signal_per_pulse * schedule_.amplitude() > 0);
  }
  void start_in_steady_state();
  void next_photon();
  bool place_photon(std::int64_t end_ps);
  [[nodiscard]] std::optional<FineTime> arrival_in_scan();
  void detect();
  [[nodiscard]] double behind_m(const FineTime& arrival);
  [[nodiscard]] std::optional<FineTime> arrival(const FineTime& emitted) const;
  [[nodiscard]] const TargetPath& motion() const { return sights_[sight_].path; }

  EmissionSchedule schedule_;
  DetectionOptions options_;
  GeneratorClock clock_;
  std::vector<Sight> sights_;       // of each pixel of a scan, or one
  std::size_t sight_ = 0;           // that the next photon meets
  std::optional<Scanner> scanner_;  // of a scan
  Random random_;
  PendingTimes pending_;
  double accumulated_ = 0;     // amplitude since the period's start, at the next photon
  bool is_placed_ = false;     // the next photon, in its pulse
  double pulse_time_ps_ = -1;  // of the next photon's pulse, since the period's start
  double pulse_jitter_ps_ = 0;
  FineTime emitted_;
  std::optional<FineTime> arrival_;  // of the next photon, before the detector's jitter
};

}  // namespace splid::simulator
