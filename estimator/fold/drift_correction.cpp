#include "estimator/fold/drift_correction.hpp"

#include "estimator/fold/kernel_choice.hpp"
#include "estimator/model/units.hpp"

namespace splid {

DriftCorrection::DriftCorrection(const FrameView& frame, double period_ns)
    : frame_(frame),
      mid_ps_(frame.mid_ps()),
      period_ns_(period_ns),
      scale_(frame.sync.period_ps * ns_per_ps / period_ns),
      to_ns_(ns_per_ps / scale_),
      length_ns_(static_cast<double>(frame.end_ps - frame.start_ps) * to_ns_) {}

void DriftCorrection::correct(double* times_ns, double* phases_ns, std::uint32_t* phases_32) const {
  const SyncFit& sync = frame_.sync;
  const double start_phase_ps =
      static_cast<double>(sync.origin_ps - mid_ps_) + sync.phase_ps - sync.bend_ps * sync.bend_zero;
  const double half_ps = static_cast<double>(frame_.end_ps - frame_.start_ps) / 2;
  const double turns_per_ps = 1 / sync.period_ps;
  best_search_kernels().fold(times_ns, phases_ns, phases_32, frame_.photons_ps.data(),
                             {mid_ps_, to_ns_, turns_per_ps, start_phase_ps * turns_per_ps,
                              sync.bend_ps * turns_per_ps / (half_ps * half_ps), period_ns_},
                             frame_.photons_ps.size());
}

}  // namespace splid
