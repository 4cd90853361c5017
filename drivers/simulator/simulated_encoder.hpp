#pragma once

#include <cstdint>

#include "drivers/encoder/encoder_source.hpp"
#include "drivers/simulator/fine_time.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "drivers/simulator/target_path.hpp"

namespace splid::simulator {

// The counts of an encoder on a simulated target: the target's true place at each tick of the
// scene's sample clock, to the nearest count. The counts have no end.
class Encoder final : public EncoderSource {
 public:
  // scene: its encoder_rate_hz is > 0.
  Encoder(const Options& scene, EncoderOptions options);

  bool next(EncoderBatch& batch) override;
  [[nodiscard]] bool live() const override { return false; }

 private:
  TargetPath motion_;
  EncoderOptions options_;
  FineTime time_;  // of the next count
  double gap_ps_;
  std::int64_t index_ = 0;
};

}  // namespace splid::simulator
