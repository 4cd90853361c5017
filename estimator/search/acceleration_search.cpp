#include "estimator/search/acceleration_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

// Half the distance, in delay bins, of the quadratic terms that are tried. A path whose term is off
// by a third of a bin lies within half a bin about its best straight line.
constexpr double half_step_bins = 1.0 / 3;

constexpr int most_zooms = 6;

constexpr std::size_t most_best_cells = 16;

}  // namespace

AccelerationSearch::AccelerationSearch(TargetSearch& search, const PulseTrain& train,
                                       double width_ns, double max_acceleration_mps2,
                                       std::size_t max_photons,
                                       std::optional<DeadIntervals> straight_dead)
    : search_(search),
      train_(train),
      width_ns_(width_ns),
      max_acceleration_mps2_(max_acceleration_mps2),
      straight_(train, max_photons),
      straight_dead_(std::move(straight_dead)),
      sample_(train, std::min(max_photons, TargetSearch::sampled_from)) {
  best_.reserve(most_best_cells + 1);
}

double AccelerationSearch::max_quadratic_ns(double length_ns) const {
  return max_acceleration_mps2_ / acceleration_of(1, length_ns);
}

double AccelerationSearch::reach_ns(double length_ns) const {
  return max_quadratic_ns(length_ns) + 2 * half_pulse_widths * width_ns_;
}

const FoldedFrame& AccelerationSearch::straightened_photons(const FoldedFrame& photons,
                                                            double quadratic_ns) {
  straight_.straighten(photons, quadratic_ns, train_);
  return straight_;
}

const FoldedFrame& AccelerationSearch::straightened(const FoldedFrame& frame, double quadratic_ns) {
  straight_.straighten(frame, quadratic_ns, train_);
  if (frame.dead != nullptr && straight_dead_) {
    straight_dead_->straighten(*frame.dead, quadratic_ns, train_);
    straight_.dead = &*straight_dead_;
  }
  return straight_;
}

std::optional<AcceleratedFit> AccelerationSearch::find(const FoldedFrame& frame, Effort most) {
  const std::optional<Start> start = find_start(frame, most);
  if (!start) return std::nullopt;
  likelihood::Maximum best = search_.fit(frame, start->line, 3);
  const double quadratic_ns = best.track().quadratic_ns;
  // The straightened frame is searched as any other, since the delay may be that of a side lobe,
  // and for the odds of the range.
  const std::optional<likelihood::Maximum> straight =
      search_.find(straightened(frame, quadratic_ns), most);
  if (!straight) return std::nullopt;
  if (straight->gain_nats > best.gain_nats + likelihood::Maximizer::exact_nats) {
    DelayTrack there = straight->track();
    there.quadratic_ns = quadratic_ns;
    best = search_.fit(frame, there, 3);
  }
  return AcceleratedFit{best, *straight};
}

std::optional<AccelerationSearch::Start> AccelerationSearch::find_start(const FoldedFrame& frame,
                                                                        Effort most) {
  if (frame.size() >= TargetSearch::sampled_from) {
    sample_.take_every(frame.size() / TargetSearch::sampled_photons, frame);
    const std::optional<Start> start = find_at_level(sample_, 0);
    if (start && start->box_gain_nats > search_.sure_nats()) return start;
  }
  std::optional<Start> best;
  for (std::size_t level = 0; level < search_.levels(most); ++level) {
    const std::optional<Start> start = find_at_level(frame, level);
    if (start && (!best || start->box_gain_nats > best->box_gain_nats)) best = start;
    if (best && best->box_gain_nats > search_.settled_nats()) break;
  }
  return best;
}

std::optional<AccelerationSearch::Start> AccelerationSearch::find_at_level(
    const FoldedFrame& photons, std::size_t level) {
  look(photons, level);
  std::optional<Start> best;
  const std::size_t tried = std::min(best_.size(), TargetSearch::cells_tried(photons.size()));
  for (std::size_t i = 0; i < tried; ++i) {
    const Start start = zoom_into(photons, level, best_[i].line);
    if (!best || start.box_gain_nats > best->box_gain_nats) best = start;
    // The zoom has found the path where it keeps the cell's signal. It loses most of that where the
    // cell has the wrong quadratic term, and holds a part of the path alone.
    const double in_cell =
        search_.signal_photons(photons, search_.level(level).grid.bin_ns, best_[i].count);
    if (start.box_gain_nats > search_.settled_nats() &&
        start.signal_photons > strong_side_lobe * in_cell) {
      break;
    }
  }
  return best;
}

double AccelerationSearch::half_step_ns(std::size_t level) const {
  return half_step_bins * search_.level(level).grid.bin_ns;
}

// How many quadratic terms on either side of none are looked at.
double AccelerationSearch::steps(double length_ns, std::size_t level) const {
  const double beyond_ns = max_quadratic_ns(length_ns) - half_step_ns(level);
  return std::max(0.0, std::ceil(beyond_ns / (2 * half_step_ns(level))));
}

// Fills best_ with the cells of all quadratic terms that hold the most photons.
void AccelerationSearch::look(const FoldedFrame& photons, std::size_t level) {
  const int most = static_cast<int>(steps(photons.length_ns, level));
  best_.clear();
  for (int step = -most; step <= most; ++step) {
    const double quadratic_ns = step * 2 * half_step_ns(level);
    for (SearchCell cell :
         search_.cells(straightened_photons(photons, quadratic_ns), search_.level(level))) {
      cell.line.quadratic_ns = quadratic_ns;
      keep_among(best_, most_best_cells, cell, [](const SearchCell&) { return false; });
    }
  }
}

// The terms of a zoom lie as close for half of its box as those of a look for a bin.
AccelerationSearch::Start AccelerationSearch::zoom_into(const FoldedFrame& photons,
                                                        std::size_t level, DelayTrack track) {
  const double step_ns = 2 * half_step_bins * half_pulse_widths * width_ns_;
  const double half_ns = std::min(half_step_ns(level), max_quadratic_ns(photons.length_ns));
  const int steps = static_cast<int>(std::ceil(half_ns / step_ns));
  Start at = {track};
  for (int zoom = 0; zoom < most_zooms; ++zoom) {
    const double from_ns = at.line.quadratic_ns;
    at = search_.zoom_into(straightened_photons(photons, from_ns), search_.level(level),
                           {at.line.delay_ns, at.line.walk_ns}, zoom == 0, step_ns, steps);
    const double moved_ns = at.line.quadratic_ns;
    at.line.quadratic_ns += from_ns;
    if (std::abs(moved_ns) < (steps - 0.5) * step_ns) break;
  }
  return at;
}

}  // namespace splid
