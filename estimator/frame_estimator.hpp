#pragma once

#include <cstddef>
#include <memory>

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/options.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// Estimates a target's delay, velocity, signal and background from one frame of photons, by a
// global search over (delay, velocity) and refinement by maximum likelihood. A function of its
// input: the same frame (and track) gives the same bits, whatever came before and on whichever
// machine's vector width.
//
// Threads: one an object; objects share nothing. Errors: none after construction; a frame that
// cannot be estimated has a status that says why. No allocation in estimate() for frames of up to
// max_photons; of more photons an even subset is used.
class FrameEstimator {
 public:
  // Errors: Error(Fault::usage) where the pattern and the options do not fit together.
  FrameEstimator(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene,
                 const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons);
  ~FrameEstimator();
  FrameEstimator(FrameEstimator&&) noexcept;

  // track: where to look first, and where to put what was found; null: the whole range is searched.
  // A track that finds nothing keeps what it knows, for a second of gap at most. most: levels of
  // the search beyond this effort are left out, for when there is no time; those of method search.
  Estimate estimate(const FrameView& view, TargetTrack* track = nullptr,
                    Effort most = Effort::exhaustive);

 private:
  struct Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace splid
