#pragma once

#include <stop_token>

#include "drivers/simulator/simulator_options.hpp"
#include "drivers/source.hpp"
#include "protocol/pattern.hpp"

// drivers/simulator/ makes the tags of a scene. Read this header first, then in the order of the
// light:
//
//   emission       when pulses leave, by the generator's clock
//   target_path    where a target is at a time
//   echo           when the light of a pulse is back
//   signal_stream  the times of signal and background at the detector
//   foreign_stream the times of light that is not the pattern's
//   detectors      which of these times a detector with a dead time and jitter reports
//   sync_stream    the syncs, as an instrument sends them
//   scene          all of these in the order of time, and scene_truth what is true of them
//
// An array of pixels has besides
//
//   surface        planes, pictures and a room that the pixels look at
//   array_pixels   a scene for each pixel, by what it looks at
//   array_scene    all pixels in the order of time, with crosstalk and their cables' delays
//   scanner        where one detector looks that a scan turns to the pixels, and its markers

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
  template <class AnyScene>
  void play(AnyScene& scene, TagSink& sink, const std::stop_token& stop) const;

  Options options_;
  Pattern pattern_;
};

}  // namespace splid::simulator
