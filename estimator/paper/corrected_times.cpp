#include "estimator/paper/corrected_times.hpp"

#include <cmath>
#include <cstdint>

#include "estimator/model/units.hpp"

namespace splid::paper {

CorrectedTimes::CorrectedTimes(const FrameView& view, double period) : period_ns(period) {
  scale = view.sync.period_ps * ns_per_ps / period_ns;  // [P] Eq. 20; Eq. 19 is in sync.period_ps
  const double to_ns = ns_per_ps / scale;
  // Times are whole picoseconds up to the frame's start, and doubles from there on.
  const double pattern_start_ps =
      static_cast<double>(view.sync.origin_ps - view.start_ps) + view.sync.phase_ps;
  const auto phase_of = [&](double time_ps) {
    double turns = (time_ps - pattern_start_ps) / view.sync.period_ps;
    turns -= std::floor(turns);
    return turns < 1 ? turns * period_ns : 0.0;
  };
  start_phase_ns = phase_of(0);
  length_ns = static_cast<double>(view.end_ps - view.start_ps) * to_ns;
  time_ns.reserve(view.photons_ps.size());
  phase_ns.reserve(view.photons_ps.size());
  for (const std::int64_t photon_ps : view.photons_ps) {
    const auto time_ps = static_cast<double>(photon_ps - view.start_ps);
    time_ns.push_back(time_ps * to_ns);
    phase_ns.push_back(phase_of(time_ps));
  }

  double begin_ns = 0;
  const auto add_seen = [&](double until_ns) {
    if (until_ns <= begin_ns) return;
    seen.push_back({begin_ns, until_ns});
    seen_ns += until_ns - begin_ns;
  };
  for (const Loss& loss : view.losses) {
    add_seen(static_cast<double>(loss.begin_ps - view.start_ps) * to_ns);
    begin_ns = static_cast<double>(loss.end_ps - view.start_ps) * to_ns;
  }
  add_seen(length_ns);
}

}  // namespace splid::paper
