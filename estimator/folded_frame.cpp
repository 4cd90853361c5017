#include "estimator/folded_frame.hpp"

#include <cmath>

#include "estimator/search_dispatch.hpp"
#include "estimator/units.hpp"

namespace splid {

FoldedFrame::FoldedFrame(std::size_t max_photons) {
  phase_ns.reserve(max_photons);
  time_ns.reserve(max_photons);
  phase_32.reserve(max_photons);
  lost_begin_ns.reserve(64);
  lost_end_ns.reserve(64);
}

void FoldedFrame::fold(const FrameView& frame, double period_ns) {
  const std::size_t count = frame.photons_ps.size();
  phase_ns.resize(count);
  time_ns.resize(count);
  phase_32.resize(count);
  const std::int64_t mid_ps = frame.start_ps + (frame.end_ps - frame.start_ps) / 2;
  scale = frame.sync.period_ps * ns_per_ps / period_ns;
  const double to_ns = ns_per_ps / scale;
  length_ns = static_cast<double>(frame.end_ps - frame.start_ps) * to_ns;

  // Integers up to mid-frame, doubles from there: a 50 ms frame's ps are exact in them.
  const double start_phase_ps =
      static_cast<double>(frame.sync.origin_ps - mid_ps) + frame.sync.phase_ps;
  const double turns_per_ps = 1 / frame.sync.period_ps;
  for (std::size_t i = 0; i < count; ++i) {
    const auto time_ps = static_cast<double>(frame.photons_ps[i] - mid_ps);
    double turns = (time_ps - start_phase_ps) * turns_per_ps;
    turns -= std::floor(turns);
    time_ns[i] = time_ps * to_ns;
    phase_ns[i] = turns * period_ns;
    phase_32[i] = static_cast<std::uint32_t>(static_cast<std::uint64_t>(turns * 0x1p32));
  }

  seen_ns = static_cast<double>(frame.end_ps - frame.start_ps) * ns_per_ps;
  lost_begin_ns.clear();
  lost_end_ns.clear();
  for (const Loss& loss : frame.losses) {
    seen_ns -= static_cast<double>(loss.end_ps - loss.begin_ps) * ns_per_ps;
    lost_begin_ns.push_back(static_cast<double>(loss.begin_ps - mid_ps) * to_ns);
    lost_end_ns.push_back(static_cast<double>(loss.end_ps - mid_ps) * to_ns);
  }
}

NearSet::NearSet(std::size_t max_photons, std::size_t max_entries) {
  residual_ns.reserve(max_entries);
  position.reserve(max_entries);
  amplitude.reserve(max_entries);
  first.reserve(max_photons + 1);
  phase_32_.reserve(max_photons);
  picked_.reserve(max_photons);
}

void NearSet::collect(const FoldedFrame& frame, const CombWindow& window, double period_ns,
                      DelayLine about) {
  line = about;
  residual_ns.clear();
  position.clear();
  amplitude.clear();
  first.clear();
  phase_32_.resize(frame.size());
  picked_.resize(frame.size());
  const SearchKernels& kernels = best_search_kernels();
  const double slope = about.drift_ns / frame.length_ns;
  const double to_32 = 0x1p32 / period_ns;
  kernels.line_phases(phase_32_.data(), frame.phase_32.data(), frame.time_ns.data(),
                      std::remainder(about.delay_ns, period_ns) * to_32, slope * to_32,
                      frame.size());
  const std::size_t picked =
      kernels.pick(picked_.data(), phase_32_.data(), window.flags(), window.shift(), frame.size());
  // Whole 2^-32 of a period say which photons and on which turn; doubles, good to 1e-16, where.
  for (std::size_t n = 0; n < picked; ++n) {
    const std::size_t i = picked_[n];
    const double coarse = phase_32_[i] / to_32;
    const double phase = frame.phase_ns[i] - about.delay_ns - slope * frame.time_ns[i];
    add_photon(frame, i, coarse + std::remainder(phase - coarse, period_ns),
               window.candidates(phase_32_[i]), window);
  }
  far_photons = frame.size() - first.size();
  first.push_back(static_cast<std::uint32_t>(residual_ns.size()));
}

void NearSet::add_photon(const FoldedFrame& frame, std::size_t photon, double phase_ns,
                         std::span<const CombWindow::Pulse> pulses, const CombWindow& window) {
  const std::size_t before = residual_ns.size();
  for (const CombWindow::Pulse& pulse : pulses) {
    const double residual = phase_ns - pulse.time_ns;
    if (residual < window.first_ns() || residual > window.last_ns()) continue;
    residual_ns.push_back(residual);
    position.push_back(frame.time_ns[photon] / frame.length_ns);
    amplitude.push_back(pulse.amplitude);
  }
  if (residual_ns.size() > before) first.push_back(static_cast<std::uint32_t>(before));
}

}  // namespace splid
