#pragma once

#include <stop_token>

#include "drivers/simulator/scene.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "drivers/source.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// Tags of a simulated scene, from first principles: a pulse leaves, meets the moving target and
// comes back; with background, syncs and an encoder's sample clock. The tagger's clock is the true
// one; the generator's drifts against it.
//
// Threads, errors, timeouts: as TagSource. A heartbeat every 5 ms of the tagger's time, and one at
// the end. Errors: the truth file cannot be written (at the start of run()).
class SimulatorSource : public TagSource {
 public:
  SimulatorSource(SimulatorOptions options, Pattern pattern);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;

 private:
  SimulatorOptions options_;
  Pattern pattern_;
};

}  // namespace splid
