#include "estimator/checks/seen_light.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "estimator/fold/dead_intervals.hpp"

namespace splid::checks {
namespace {

constexpr double least_part = 1e-6;  // of a part of the frame, so that logarithms exist
constexpr double least_seen = 1e-3;  // of the light at any phase
constexpr int bins_a_width = 2, most_bins = 1 << 16;
// A detector that comes back so often within a pulse sees another pulse.
constexpr double most_back = 0.01;
constexpr std::size_t most_pulses = 256;  // that the dead time of a cell is a mean over

}  // namespace

SeenParts seen_parts(const FrameView& view) {
  SeenParts parts;
  parts.fill(1);
  if (view.losses.empty() || !(view.seen_ns() > 0)) return parts;
  const double length = static_cast<double>(view.end_ps - view.start_ps);
  for (const Loss& loss : view.losses) {
    const double begin = static_cast<double>(loss.begin_ps - view.start_ps) / length * map_parts;
    const double end = static_cast<double>(loss.end_ps - view.start_ps) / length * map_parts;
    for (std::size_t j = 0; j < map_parts; ++j) {
      const auto first = static_cast<double>(j);
      parts[j] -= std::max(0.0, std::min(end, first + 1) - std::max(begin, first));
    }
  }
  double mean = 0;
  for (double& part : parts) mean += (part = std::max(part, least_part)) / map_parts;
  for (double& part : parts) part /= mean;
  return parts;
}

SeenLightFinder::SeenLightFinder(const PulseTrain& train, const ResidualMap& map, double width_ns,
                                 double dead_time_ns)
    : train_(train) {
  if (!(dead_time_ns > 0)) return;
  for (const PulseTrain::Segment& segment : train.segments) {
    const double bins =
        std::clamp(segment.comb.period_ns * bins_a_width / width_ns, 2.0, double{most_bins});
    passed_.emplace_back(std::bit_ceil(static_cast<std::size_t>(bins)) + 1);
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
  frame_ = &frame;
  for (std::size_t s = 0; s < passed_.size(); ++s) count(map.phases_32(), s);
  see_cells(map);
  const std::size_t bins = map.by_phase().size();
  for (std::size_t k = 0; k < bins; ++k) {
    const double turns = (static_cast<double>(k) + 0.5) / static_cast<double>(bins);
    seen_.of_phase.push_back(seen_at(0, turns * train_.period_ns));
  }
  if (bins == 0) return seen_;
  const double dead_ns = frame.dead->dead_time_ns / frame.scale;
  const double pulse_ns = -2 * (map.first_light_ns() - map.peak_ns());
  for (const double time_ns : train_.segments.front().comb.times_ns) {
    const double first_ns = time_ns + map.first_light_ns();
    const double back = detected(0, first_ns - dead_ns, first_ns + pulse_ns - dead_ns);
    seen_.of_pulse.push_back(back < most_back ? seen_at(0, first_ns) : 0);
  }
  return seen_;
}

// The detections of a segment before each bin of the comb's period.
void SeenLightFinder::count(std::span<const std::uint32_t> phases_32, std::size_t segment) {
  std::vector<std::uint32_t>& passed = passed_[segment];
  std::fill(passed.begin(), passed.end(), 0);
  const int shift = 32 - std::countr_zero(passed.size() - 1);
  for (std::size_t i = frame_->group_begin(segment); i < frame_->group_end[segment]; ++i) {
    ++passed[(phases_32[i] >> shift) + 1];
  }
  std::partial_sum(passed.begin(), passed.end(), passed.begin());
}

// The detections of a segment between two phases of its comb, a period, times the share of the
// light that each hides. Photons of no group are taken to be spread as those of the groups.
double SeenLightFinder::detected(std::size_t segment, double from_ns, double to_ns) const {
  const FoldedFrame& frame = *frame_;
  const std::vector<std::uint32_t>& passed = passed_[segment];
  const PulseTrain::Segment& own = train_.segments[segment];
  const double period_ns = own.comb.period_ns, bins = static_cast<double>(passed.size() - 1);
  const auto up_to = [&](double at_ns) {
    const double turns = std::floor(at_ns / period_ns);
    const double place = std::clamp((at_ns / period_ns - turns) * bins, 0.0, bins - 1e-6);
    const auto k = static_cast<std::size_t>(place);
    return turns * passed.back() + passed[k] +
           (place - static_cast<double>(k)) * (passed[k + 1] - passed[k]);
  };
  const double grouped = static_cast<double>(frame.group_end[passed_.size() - 1]);
  const double seen_ns = frame.seen_ns / frame.scale * grouped / static_cast<double>(frame.size());
  const double periods = seen_ns * (own.end_ns - own.begin_ns) / train_.period_ns / period_ns;
  return frame.dead->share * (up_to(to_ns) - up_to(from_ns)) / periods;
}

double SeenLightFinder::seen_at(std::size_t segment, double phase_ns) const {
  const double dead_ns = frame_->dead->dead_time_ns / frame_->scale;
  return std::max(least_seen, 1 - detected(segment, phase_ns - dead_ns, phase_ns));
}

void SeenLightFinder::see_cells(const ResidualMap& map) {
  std::array<double, most_cells> sums{};
  double light = 0;
  for (std::size_t s = 0; s < passed_.size(); ++s) {
    const PulseTrain::Segment& segment = train_.segments[s];
    const Comb& comb = segment.comb;
    const double turns = (segment.end_ns - segment.begin_ns) / comb.period_ns;
    const std::size_t step = 1 + comb.times_ns.size() / most_pulses;
    for (std::size_t p = 0; p < comb.times_ns.size(); p += step) {
      light += turns * comb.amplitudes[p];
      for (std::size_t i = 0; i < map.cells(); ++i) {
        const double mid_ns = comb.times_ns[p] + map.edge_ns(i) + map.cell_ns(i) / 2;
        sums[i] += turns * comb.amplitudes[p] * seen_at(s, mid_ns);
      }
    }
  }
  double mean = 0;
  for (std::size_t i = 0; i < map.cells(); ++i) {
    seen_.of_cell[i] = sums[i] / light;
    mean += seen_.of_cell[i] * map.cell_ns(i) / (2 * map.reach_ns());
  }
  const double of_map = std::min(most_blind, train_.pulses_per_ns * 2 * map.reach_ns());
  const double of_all = 1 - frame_->dead_ns() / frame_->seen_ns;
  seen_.elsewhere = std::max(least_seen, (of_all - of_map * mean) / (1 - of_map));
}

}  // namespace splid::checks
