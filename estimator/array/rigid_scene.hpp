#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "estimator/array/neighbours.hpp"
#include "estimator/array/shared_fit.hpp"
#include "estimator/array/velocity_votes.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/search/frame_search.hpp"

namespace splid::array {

// The pixels of a frame, as RigidScene takes and leaves them.
struct RigidFrame {
  std::span<const FrameView> frames;  // of each pixel
  std::span<Estimate> estimates;      // of each pixel, from FrameEstimator
  std::span<int> bodies;              // which body a pixel sees, from 0; -1: none
};

// Finds the pixels that share a velocity, and estimates them by it: scene `rigid`. Each keeps a
// distance of its own. At a known velocity a pixel is one at rest (at_rest()), whose delay alone
// FrameEstimator searches: it shows a distance with fewer photons than it needs alone, and its
// velocity has the deviation of all photons of the body.
//
// The velocity comes from the estimates that the pixels have alone; where these do not tell it at
// the risk `range_risk`, from the best cells of each pixel. A pixel that disagrees by certain_nats
// keeps its own; those that agree with each other are the next body. A body turns where a velocity
// that changes evenly over the field gains as much.
//
// Errors: as FrameEstimator's constructor.
class RigidScene {
 public:
  // The arguments are those of FrameEstimator. directions: of each pixel; where they are all one, a
  // body does not turn.
  RigidScene(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene,
             const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons,
             std::span<const PixelDirection> directions,
             ClockReference reference = ClockReference::tagger,
             const DetectorOptions& detector = {});

  // A frame of as many pixels as there are directions. Returns the number of bodies.
  std::size_t estimate(const RigidFrame& frame);

  static constexpr std::size_t most_bodies = 4;

 private:
  // The pixels that see no body yet.
  [[nodiscard]] static bool is_open(const RigidFrame& frame, std::size_t pixel) {
    const FrameView& view = frame.frames[pixel];
    return frame.bodies[pixel] < 0 && view.sync.locked && !view.photons_ps.empty();
  }
  std::optional<SharedVelocity> choose(const RigidFrame& frame);
  void vote_alone(const RigidFrame& frame);
  void vote_by_cells(const RigidFrame& frame);
  void add_cells(const FrameView& view, std::size_t pixel);
  bool fit(const RigidFrame& frame, const Velocity& start);
  void take_members(const RigidFrame& frame, const Velocity& about);
  void add_member(const RigidFrame& frame, std::size_t pixel, const Estimate& estimate,
                  const FrameView& view);
  bool keep_fitting(Eigen::Index terms, Terms& at);
  std::size_t report(const RigidFrame& frame, int body);
  [[nodiscard]] TargetTrack where_fitted(const SharedPixel& member, const FrameView& still,
                                         const Estimate& own) const;
  [[nodiscard]] Velocity velocity_of(std::size_t pixel, const SyncFit& sync) const;

  ClockReference reference_;
  double max_speed_mps_;
  PulseTrain train_;
  std::unique_ptr<PulseShape> shape_;
  double least_odds_nats_;
  std::vector<Terms> rows_;  // of each pixel
  FrameEstimator at_rest_;   // of a pixel whose velocity is known
  FoldedFrame folded_;
  FrameSearch search_;
  SharedFit shared_fit_;
  SharedMaximum shared_;  // of the body that is being looked at
  std::vector<Vote> votes_;
  std::vector<SharedPixel> members_;
  std::vector<SearchCell> cells_;  // scratch
};

}  // namespace splid::array
