#include "estimator/zoom.hpp"

#include <algorithm>
#include <cmath>

namespace splid {

Zoom::Zoom(double width_ns, double peak_offset_ns)
    : width_ns_(width_ns), peak_offset_ns_(peak_offset_ns), counts_(2 * max_steps + 2) {}

DelayLine Zoom::find(const NearSet& near, double reach_ns, bool moving) {
  const double finest_ns = 2 * width_ns_;
  DelayLine line = near.line;
  double reach = reach_ns;
  while (true) {
    const double step = std::max(finest_ns, reach / max_steps);
    line = best_of(near, line, reach, step, moving);
    if (step <= finest_ns) return line;
    reach = 2 * step;
  }
}

DelayLine Zoom::best_of(const NearSet& near, DelayLine about, double reach_ns, double step_ns,
                        bool moving) {
  const int delays = std::min(max_steps, static_cast<int>(std::ceil(reach_ns / step_ns)));
  // A drift step moves the ends of the line by half of what it moves the sum of both.
  const int drifts = moving ? static_cast<int>(std::ceil(reach_ns / step_ns)) : 0;
  const double per_step = 1 / step_ns;
  DelayLine best = about;
  std::uint32_t most = 0;
  for (int drift = -drifts; drift <= drifts; ++drift) {
    std::fill(counts_.begin(), counts_.end(), 0);
    const double slope = about.drift_ns - near.line.drift_ns + 2 * drift * step_ns;
    const double start = about.delay_ns - near.line.delay_ns + peak_offset_ns_ - delays * step_ns;
    for (std::size_t j = 0; j < near.entries(); ++j) {
      const double at = (near.residual_ns[j] - slope * near.position[j] - start) * per_step;
      if (at >= 0 && at < 2 * delays + 1) ++counts_[static_cast<std::size_t>(at)];
    }
    // Two neighbouring steps together hold a pulse of four widths wherever it lies in them.
    for (int d = 0; d < 2 * delays; ++d) {
      const auto k = static_cast<std::size_t>(d);
      const std::uint32_t count = counts_[k] + counts_[k + 1];
      if (count > most) {
        most = count;
        best = {about.delay_ns + (d + 1 - delays) * step_ns, about.drift_ns + 2 * drift * step_ns};
      }
    }
  }
  return best;
}

}  // namespace splid
