#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/simulator/array_options.hpp"
#include "drivers/simulator/detectors.hpp"
#include "drivers/simulator/fine_time.hpp"
#include "drivers/simulator/foreign_stream.hpp"
#include "drivers/simulator/scanner.hpp"
#include "drivers/simulator/scanner_options.hpp"
#include "drivers/simulator/signal_stream.hpp"
#include "drivers/simulator/sync_stream.hpp"
#include "drivers/simulator/target_path.hpp"
#include "drivers/source.hpp"

namespace splid::simulator {

enum class Speed {
  live,  // device time follows the steady clock
  max,   // as fast as the sink takes it
};

// A target beside the scene's first one: its path, and its light. JSON: the path's keys and
// `signal_per_pulse`.
struct FurtherTarget {
  TargetOptions path;
  double signal_per_pulse = 13.5e-4;  // mean detections of a pulse of amplitude 1
};

// Fog or haze: a smooth return without a surface, beside that of the targets. JSON: `source`/`fog`.
struct FogOptions {
  double counts_per_pulse = 0;  // mean detections of a pulse of amplitude 1; 0: no fog
  double distance_m = 0;        // where it begins
  double depth_m = 40;          // mean way from there to where light is sent back
  void describe(OptionVisitor& visitor);
};

// A simulated scene; the defaults are [P]'s set-up. JSON: `source` with the driver "simulator".
//
// Design note: of [P]'s delay of 1898 ns, 1855 ns were in the electronics. In the default scene the
// whole delay is distance, so that a configuration without range offset reads the truth.
struct Options : SourceOptions {
  TargetOptions target;
  std::vector<FurtherTarget> more_targets;
  FogOptions fog;
  ForeignOptions foreign;
  DetectionOptions detection;  // its keys stand in `source` itself
  DetectorModel detector;
  SyncOptions sync;
  ArrayOptions array;  // where it has pixels, each has a target of its own in the place of `target`
  ScannerOptions scanner;           // one detector looks at the array's pixels one after another
  double ambient_per_s = 174'500;   // together with the dark counts 1.75e-4 a ns
  double dark_per_s = 500;          // dark counts of the detector
  double drift_ppm = 2;             // pattern period in the tagger's clock, against the calibrated
  double drift_ramp_ppm_per_s = 0;  // change of the drift
  double tagger_ppm = 0;            // by which the tagger's clock is fast
  double encoder_rate_hz = 0;       // DAQ sample clock on marker 1; 0: none
  double encoder_start_s = 0.2;     // first tick: late enough for the start to be seen
  std::int64_t start_ps = 0;        // tagger's clock at the stream's start
  std::int64_t seed = 1;
  double seconds = 0;  // of the tagger's time; 0: for ever
  Speed pace = Speed::live;
  std::string truth;  // file to write; empty: none
  std::int64_t photon_input = 1;

  [[nodiscard]] double background_per_s() const { return ambient_per_s + dark_per_s; }
  // The seconds that the tagger counts in a true second.
  [[nodiscard]] double tagger_rate() const { return 1 + 1e-6 * tagger_ppm; }
  // Absent where there is no scan.
  [[nodiscard]] std::optional<Scanner> scanner_in_use() const;
  // The time of the encoder's first tick, since the stream's start.
  [[nodiscard]] FineTime encoder_start() const {
    return FineTime{}.after(encoder_start_s * ps_per_s);
  }

  void describe(OptionVisitor& visitor) override;
  [[nodiscard]] std::optional<OptionFault> validate() const override;
  [[nodiscard]] std::optional<OptionFault> start_fault() const override;
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
  // The sample clock's encoder, where there is one.
  [[nodiscard]] std::unique_ptr<EncoderSource> own_encoder(
      const EncoderOptions& encoder) const override;

 private:
  [[nodiscard]] std::optional<OptionFault> array_fault() const;
  [[nodiscard]] std::optional<OptionFault> scanner_fault() const;
};

}  // namespace splid::simulator
