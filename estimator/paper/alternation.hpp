#pragma once

#include "estimator/likelihood/log_likelihood.hpp"
#include "estimator/model/estimate.hpp"

namespace splid::paper {

// What [P] estimates of a frame. The delay is in the pattern's clock; rates count the tagger's ns.
struct PaperParameters {
  double delay_ns = 0;  // tau, round trip at the frame's start
  double velocity_mps = 0;
  double signal_per_pulse = 0;   // S >= 0
  double background_per_ns = 0;  // b > 0
};

struct AlternationResult {
  PaperParameters parameters;
  double gain_nats = 0;  // log-likelihood over no target
  Stop stop = Stop::not_run;
};

// The refinement of [P]: L-BFGS (LD_LBFGS of NLopt) on (S, b) and on (tau, v) in turn, until
// neither pair moves. tau stays within ten pulse widths of the start. moving: false keeps the
// start's v. likelihood: of a frame that has begun.
//
// Frames without photons stop with not_run. Throws nothing but std::bad_alloc.
AlternationResult alternate(likelihood::LogLikelihood& likelihood, const PaperParameters& start,
                            bool moving);

}  // namespace splid::paper
