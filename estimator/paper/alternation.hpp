#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/paper/paper_likelihood.hpp"

namespace splid::paper {

struct AlternationResult {
  PaperParameters parameters;
  double gain_nats = 0;  // log-likelihood over no target
  Stop stop = Stop::not_run;
};

// The refinement of [P]: L-BFGS (LD_LBFGS of NLopt) on (S, b) and on (tau, v) in turn, until
// neither pair moves. tau stays within ten pulse widths of the start. moving: false keeps the
// start's v.
//
// Frames without photons stop with not_run. Throws nothing but std::bad_alloc.
AlternationResult alternate(PaperLikelihood& likelihood, const PaperParameters& start, bool moving);

}  // namespace splid::paper
