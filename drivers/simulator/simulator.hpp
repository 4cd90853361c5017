#pragma once

#include <stop_token>

#include "drivers/simulator/scene.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "drivers/source.hpp"
#include "protocol/pattern.hpp"

namespace splid::simulator {

// The tags of a simulated scene, from first principles: a pulse leaves, meets the moving target and
// comes back. Background, syncs and an encoder's sample clock come with them. The tagger's clock is
// true; the generator's clock drifts against it.
//
// Threads, errors, timeouts: as TagSource. There is a heartbeat every 5 ms of the tagger's time,
// and one at the end. Errors: run() throws at its start where the truth file cannot be written.
class Source : public TagSource {
 public:
  Source(Options options, Pattern pattern);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;

 private:
  Options options_;
  Pattern pattern_;
};

}  // namespace splid::simulator
