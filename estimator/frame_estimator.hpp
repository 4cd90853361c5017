#pragma once

#include <cstddef>
#include <memory>

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/options.hpp"
#include "protocol/pattern.hpp"

// Read this header first. FrameEstimator is what the rest of splid uses of estimator/ while it
// measures: a frame of photons goes in, an estimate comes out, by way of the rooms below.
//
//   sync/         before a frame comes here: the pattern's clock by the frame's syncs, [P] Eq. 19
//   model/        FrameView is the frame, Estimate the result; PulseTrain and PulseShape are the
//                 pattern and the detected pulse
//   fold/         the photons in the pattern's clock ([P] Eq. 20), folded on the pattern period: a
//                 target at constant velocity is a straight line there, a DelayTrack
//   search/       the target: where the last frame had it, along all straight lines, along all
//                 accelerated paths; its significance, and the odds of its range
//   selection/    the targets beside the first one
//   likelihood/   one model of the light; its maximum ([P] Eq. 4 and 7) and the deviations there
//   checks/       which richer model explains the photons better
//   paper/        what search/ does as [P] does it, for comparison
//   calibration/  not on this way: the pulses in a recording of a target at rest
//
// Unless a header says otherwise, in all rooms: an object serves one thread, and its const calls
// and free functions any; what a constructor takes by reference outlives the object; nothing fails;
// and nothing allocates after construction, for frames of up to max_photons, but in paper/ and
// calibration/.
//
// [P] is TR2026-050, "Unambiguous Range Extension for Doppler Single-Photon Lidar" (Optics Express
// 2026). docs/estimation.md tells the whole as a text, with the reasons.

namespace splid {

// Estimates the targets of one frame of photons by a global search over delay and velocity and by
// maximum likelihood. The same frame (and the same track) gives the same bits, whatever frames came
// before and whichever vector width the machine has; only recent_findings tell of other frames.
//
// Errors: none after construction; a frame that cannot be estimated has a status that says why. A
// frame of more than max_photons makes the memory grow.
class FrameEstimator {
 public:
  // frame_length_ms: nominal, > 0. max_photons: that a frame may have. reference: whose clock the
  // estimate's delays are in. detector, inputs: the detector, and over how many inputs, each dead
  // on its own, the light is split, by the shares that FrameView's counts of each input tell;
  // method paper knows no dead time.
  // Errors: Error(Fault::usage) where the pattern and the options do not fit together.
  FrameEstimator(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene,
                 const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons,
                 ClockReference reference = ClockReference::tagger,
                 const DetectorOptions& detector = {}, std::size_t inputs = 1);
  ~FrameEstimator();
  FrameEstimator(FrameEstimator&&) noexcept;

  // Of the frames that follow, no recent_findings: they are of several pixels in turn, and what
  // many frames show together would be none of the pixels'.
  void leave_out_recent_findings();

  // The estimate of one frame; see Estimate for units and for which members hold when.
  //
  // track: where to look first, and where to put what was found. Null: the whole range is searched.
  // A track that finds nothing keeps what it knows, for a gap of one second at most.
  // most: the search leaves out its levels beyond this effort, for when there is no time. It is of
  // no effect with method paper.
  Estimate estimate(const FrameView& view, TargetTrack* track = nullptr,
                    Effort most = Effort::balanced);

 private:
  struct Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace splid
