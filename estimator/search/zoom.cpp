#include "estimator/search/zoom.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/fold/kernel_choice.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {
namespace {

constexpr int box_steps = 2 * static_cast<int>(half_pulse_widths);

}  // namespace

Zoom::Zoom(double width_ns, double peak_offset_ns)
    : kernels_(best_search_kernels()),
      width_ns_(width_ns),
      peak_offset_ns_(peak_offset_ns),
      rows_(std::size_t{slices} * bins),
      counts_(bins) {}

ZoomResult Zoom::find(const NearSet& near, double reach_ns, bool moving) {
  DelayTrack line = near.track;
  double reach = reach_ns;
  while (true) {
    const double step = std::max(width_ns_, reach / max_steps);
    const ZoomResult best = best_of(near, line, reach, step, moving);
    if (step <= width_ns_) return best;
    line = best.line;
    reach = 2 * step;
  }
}

// Fills row r with the entries of slice r, by their distance in steps from the line `about`.
void Zoom::fill(const NearSet& near, DelayTrack about, double first_ns, double per_bin) {
  std::fill(rows_.begin(), rows_.end(), 0);
  const double slope = about.walk_ns - near.track.walk_ns;
  const double start = about.delay_ns - near.track.delay_ns + peak_offset_ns_ + first_ns;
  for (std::size_t j = 0; j < near.entries(); ++j) {
    const double s = near.position[j];
    const double bin = (near.residual_ns[j] - slope * s - start) * per_bin;
    if (!(bin >= 0 && bin < bins)) continue;
    const double slice = std::clamp((s + 0.5) * slices, 0.0, slices - 1.0);
    ++rows_[static_cast<std::size_t>(slice) * bins + static_cast<std::size_t>(bin)];
  }
}

ZoomResult Zoom::best_of(const NearSet& near, DelayTrack about, double reach_ns, double step_ns,
                         bool moving) {
  // Travels are tried in double steps: the ends of a line move by half of what its range walk
  // changes.
  const int steps = std::min(max_steps, static_cast<int>(std::ceil(reach_ns / step_ns)));
  const int walks = moving ? steps : 0;
  fill(near, about, -margin * step_ns, 1 / step_ns);
  ZoomResult best = {about, 0, box_steps * step_ns};
  const int first = margin - steps - box_steps / 2;  // the first bin that a box reaches
  const int count = 2 * steps + box_steps;
  for (int walk = -walks; walk <= walks; ++walk) {
    std::fill_n(counts_.begin(), count, 0);
    for (int slice = 0; slice < slices; ++slice) {
      const double s = (slice + 0.5) / slices - 0.5;
      const int shift = static_cast<int>(std::lround(2 * walk * s));
      kernels_.longs.accumulate(counts_.data(),
                                rows_.data() + std::ptrdiff_t{slice} * bins + first + shift,
                                static_cast<std::size_t>(count));
    }
    std::uint32_t in_box = 0;
    for (int k = 0; k < count; ++k) {
      in_box += counts_[static_cast<std::size_t>(k)];
      if (k >= box_steps) in_box -= counts_[static_cast<std::size_t>(k - box_steps)];
      if (k < box_steps - 1 || in_box <= best.count) continue;
      // The box ends with bin first + k, so that its middle is box_steps / 2 before that bin's end.
      const int middle = first + k + 1 - box_steps / 2 - margin;
      best.count = in_box;
      best.line = {about.delay_ns + middle * step_ns, about.walk_ns + 2 * walk * step_ns};
    }
  }
  return best;
}

}  // namespace splid
