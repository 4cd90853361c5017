#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/paper/paper_likelihood.hpp"

namespace splid::paper {

struct AlternationResult {
  PaperParameters parameters;
  double gain_nats = 0;  // log-likelihood over no target
  Stop stop = Stop::not_run;
};

// [P]'s refinement: L-BFGS (NLopt's LD_LBFGS) on (S, b) and on (tau, v) in turn, until neither
// moves, tau within ten pulse widths of the start. moving false keeps the start's v.
//
// Frames without photons stop with not_run. Throws std::bad_alloc alone. Threads: as likelihood.
AlternationResult alternate(PaperLikelihood& likelihood, const PaperParameters& start, bool moving);

}  // namespace splid::paper
