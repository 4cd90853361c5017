#include "estimator/checks/seen_light.hpp"

#include <algorithm>
#include <cmath>

namespace splid::checks {
namespace {

// How many pulses of a comb come within a time before one of them, on average.
double pulses_within(const Comb& comb, double time_ns) {
  double pairs = 0;
  for (const double to : comb.times_ns) {
    for (const double from : comb.times_ns) {
      const double apart_ns = to - from > 0 ? to - from : to - from + comb.period_ns;
      if (apart_ns <= time_ns) pairs += 1 + std::floor((time_ns - apart_ns) / comb.period_ns);
    }
  }
  return pairs / static_cast<double>(comb.times_ns.size());
}

constexpr double least_part = 1e-6;  // of a part of the frame, so that logarithms exist
constexpr double least_seen = 1e-3;  // of the light at any phase

}  // namespace

SeenParts seen_parts(const FrameView& view) {
  SeenParts parts;
  parts.fill(1);
  if (view.losses.empty() || !(view.seen_ns() > 0)) return parts;
  const double length = static_cast<double>(view.end_ps - view.start_ps);
  for (const Loss& loss : view.losses) {
    const double begin = static_cast<double>(loss.begin_ps - view.start_ps) / length * map_parts;
    const double end = static_cast<double>(loss.end_ps - view.start_ps) / length * map_parts;
    for (auto j = static_cast<std::size_t>(begin); j < map_parts && static_cast<double>(j) < end;
         ++j) {
      const auto first = static_cast<double>(j);
      parts[j] -= std::min(end, first + 1) - std::max(begin, first);
    }
  }
  double mean = 0;
  for (double& part : parts) mean += (part = std::max(part, least_part)) / map_parts;
  for (double& part : parts) part /= mean;
  return parts;
}

SeenLightFinder::SeenLightFinder(const PulseTrain& train, const ResidualMap& map,
                                 double dead_time_ns)
    : train_(train) {
  if (dead_time_ns > 0) {
    pulses_before_ = train.single() ? pulses_within(train.segments.front().comb, dead_time_ns)
                                    : dead_time_ns * train.pulses_per_ns;
  }
  seen_.of_phase.reserve(map.by_phase().size());
  seen_.of_pulse.reserve(map.by_pulse().size());
}

const SeenLight& SeenLightFinder::look(const FoldedFrame& frame, const ResidualMap& map,
                                       const SeenParts& parts) {
  seen_.of_part = parts;
  seen_.of_cell.fill(1);
  seen_.elsewhere = 1;
  seen_.of_phase.clear();
  seen_.of_pulse.clear();
  if (frame.dead == nullptr) return seen_;
  see_cells(frame, map);
  if (!map.by_phase().empty()) see_phases(frame, map);
  return seen_;
}

void SeenLightFinder::see_cells(const FoldedFrame& frame, const ResidualMap& map) {
  const DeadIntervals& intervals = *frame.dead;
  const double dead_ns = intervals.dead_time_ns / frame.scale;
  const double seen_ns = frame.seen_ns / frame.scale;
  const double pulses = train_.pulses_per_ns * seen_ns;
  const double share_of_map = std::min(most_blind, train_.pulses_per_ns * 2 * map.reach_ns());
  const double near = static_cast<double>(frame.size()) - map.elsewhere();
  // Dead before the map: from light elsewhere, and from the pulses before.
  const double before =
      map.elsewhere() / (seen_ns * (1 - share_of_map)) * dead_ns * (1 - share_of_map) +
      near / pulses * pulses_before_;
  std::array<double, most_cells> of_cell{};
  for (std::size_t i = 0; i < map.cells(); ++i) {
    for (std::size_t j = 0; j < map_parts; ++j) of_cell[i] += map.part(j)[i] / pulses;
  }
  double within = 0, mean = 0;
  std::size_t first = 0;  // the first cell within the dead time
  for (std::size_t i = 0; i < map.cells(); ++i) {
    while (map.edge_ns(first + 1) < map.edge_ns(i) - dead_ns) within -= of_cell[first++];
    const double dead = intervals.share * (before + within + of_cell[i] / 2);
    seen_.of_cell[i] = std::max(least_seen, 1 - dead);
    mean += seen_.of_cell[i] * map.cell_ns(i) / (2 * map.reach_ns());
    within += of_cell[i];
  }
  const double of_all = 1 - intervals.dead_ns / frame.seen_ns;
  seen_.elsewhere = std::max(least_seen, (of_all - share_of_map * mean) / (1 - share_of_map));
}

void SeenLightFinder::see_phases(const FoldedFrame& frame, const ResidualMap& map) {
  const std::span<const std::uint32_t> counts = map.by_phase();
  const Comb& comb = train_.segments.front().comb;
  const std::size_t bins = counts.size();
  const double bin_ns = comb.period_ns / static_cast<double>(bins);
  const double periods = frame.seen_ns / frame.scale / comb.period_ns;
  const double reach = frame.dead->dead_time_ns / frame.scale / bin_ns;  // in bins
  const auto whole = static_cast<std::size_t>(reach);
  // Detections in the dead time before the middle of bin 0: half of it, whole bins, and the rest.
  double before = 0;
  for (std::size_t n = 1; n <= whole; ++n) before += counts[(bins - n % bins) % bins];
  seen_.of_phase.resize(bins);
  for (std::size_t k = 0; k < bins; ++k) {
    const double partly =
        (reach - static_cast<double>(whole)) * counts[(k + bins - (whole + 1) % bins) % bins];
    const double dead = (before + partly) / periods * frame.dead->share;
    seen_.of_phase[k] = std::max(least_seen, 1 - dead);
    before += counts[k];
    before -= counts[(k + bins - whole % bins) % bins];
  }
  // A pulse's own photons come after the bin in which it begins.
  for (const double time_ns : comb.times_ns) {
    const double turns = (time_ns + map.first_light_ns()) / comb.period_ns;
    const auto bin =
        static_cast<std::size_t>((turns - std::floor(turns)) * static_cast<double>(bins));
    seen_.of_pulse.push_back(seen_.of_phase[bin % bins]);
  }
}

}  // namespace splid::checks
