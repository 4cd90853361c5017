#include "estimator/search/refinement.hpp"

namespace splid {
namespace {

likelihood::FreeSet free_of(bool moving) { return likelihood::free_set(1, moving ? 2 : 1); }

}  // namespace

Refinement::Refinement(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                       bool may_be_blind)
    : maximizer_(shape, train, max_photons, {1, 1, may_be_blind}) {}

Fit Refinement::climb(const FoldedFrame& frame, DelayTrack start, bool moving, double to_beat_nats,
                      bool roughly) {
  maximizer_.begin(frame);
  return fit_of(maximizer_.maximize(
      model_of({start}),
      {free_of(moving), to_beat_nats, likelihood::Maximizer::exact_nats, roughly}));
}

Fit Refinement::judge(const FoldedFrame& frame, const FrameParameters& at, bool moving) {
  maximizer_.begin(frame);
  return fit_of(maximizer_.judge(model_of(at), free_of(moving)));
}

}  // namespace splid
