#include "estimator/search/acceleration_search.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

// Half the distance, in delay bins, of the quadratic terms that are tried. A path whose term is off
// by a third of a bin lies within half a bin about its best straight line.
constexpr double half_step_bins = 1.0 / 3;

// A zoom takes steps that leave a path within 0.7 pulse widths of its best line.
constexpr double zoom_step_widths = 4.0 / 3;
constexpr int most_zooms = 6;

constexpr std::size_t most_best_cells = 16;

// Of the signal of a cell that a zoom must keep. A box of four widths holds 95 % of a pulse, so
// that a zoom that has found the path has more than the cell.
constexpr double least_signal_kept = 0.6;

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
  DelayTrack from = start->line;
  from.quadratic_ns = start->quadratic_ns;
  AcceleratedFit found = {search_.fit(frame, from, 3), {}};
  const DelayTrack track = found.best.track();
  // The straightened frame is searched as any other, since the delay may be that of a side lobe,
  // and for the odds of the range.
  const std::optional<likelihood::Maximum> straight =
      search_.find(straightened(frame, track.quadratic_ns), most);
  if (!straight) return std::nullopt;
  found.straight = *straight;
  DelayTrack there = straight->track();
  const double apart_ns =
      std::abs(std::remainder(there.delay_ns - track.delay_ns, train_.circle_ns)) +
      std::abs(there.walk_ns - track.walk_ns) / 2;
  if (straight->gain_nats > found.best.gain_nats && apart_ns > width_ns_) {
    there.quadratic_ns = track.quadratic_ns;
    found.best = search_.fit(frame, there, 3);
  }
  return found;
}

std::optional<AccelerationSearch::Start> AccelerationSearch::find_start(const FoldedFrame& frame,
                                                                        Effort most) {
  if (frame.size() >= TargetSearch::sampled_from) {
    sample_.take_every(frame.size() / TargetSearch::sampled_photons, frame);
    const std::optional<Start> start = find_at_level(sample_, 0);
    if (start && start->box_gain_nats > search_.sure_in_sample_nats()) return start;
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
    const Start start = zoom_into(photons, level, best_[i]);
    if (!best || start.box_gain_nats > best->box_gain_nats) best = start;
    // The zoom has found the path where it keeps the cell's signal. It loses most of that where the
    // cell has the wrong quadratic term, and holds a part of the path alone.
    const double in_cell =
        search_.signal_photons(photons, search_.level(level).grid.bin_ns, best_[i].count);
    if (start.box_gain_nats > search_.settled_nats() &&
        start.signal_photons > least_signal_kept * in_cell) {
      break;
    }
  }
  return best;
}

// How many quadratic terms on either side of none are looked at.
double AccelerationSearch::steps(double length_ns, std::size_t level) const {
  const double half_step_ns = half_step_bins * search_.level(level).grid.bin_ns;
  const double beyond_ns = max_quadratic_ns(length_ns) - half_step_ns;
  return std::max(0.0, std::ceil(beyond_ns / (2 * half_step_ns)));
}

// Fills best_ with the cells of all quadratic terms that hold the most photons.
void AccelerationSearch::look(const FoldedFrame& photons, std::size_t level) {
  const double step_ns = 2 * half_step_bins * search_.level(level).grid.bin_ns;
  const int most = static_cast<int>(steps(photons.length_ns, level));
  best_.clear();
  for (int step = -most; step <= most; ++step) {
    const double quadratic_ns = step * step_ns;
    for (const SearchCell& cell :
         search_.cells(straightened_photons(photons, quadratic_ns), search_.level(level))) {
      keep({cell.line, quadratic_ns, cell.count});
    }
  }
}

void AccelerationSearch::keep(const Cell& cell) {
  const auto place = std::find_if(best_.begin(), best_.end(),
                                  [&](const Cell& other) { return other.count < cell.count; });
  best_.insert(place, cell);
  if (best_.size() > most_best_cells) best_.pop_back();
}

AccelerationSearch::Start AccelerationSearch::zoom_into(const FoldedFrame& photons,
                                                        std::size_t level, const Cell& cell) {
  const double step_ns = zoom_step_widths * width_ns_;
  const double half_ns = std::min(half_step_bins * search_.level(level).grid.bin_ns,
                                  max_quadratic_ns(photons.length_ns));
  const int steps = static_cast<int>(std::ceil(half_ns / step_ns));
  Start at = {cell.line, cell.quadratic_ns, 0, 0};
  bool is_cell = true;  // the line is where the photons are, and not where the target is
  for (int zoom = 0; zoom < most_zooms; ++zoom) {
    const TargetSearch::Spot spot =
        search_.zoom_into(straightened_photons(photons, at.quadratic_ns), search_.level(level),
                          at.line, is_cell, step_ns, steps);
    at = {spot.line, at.quadratic_ns + spot.quadratic_ns, spot.box_gain_nats, spot.signal_photons};
    is_cell = false;
    if (std::abs(spot.quadratic_ns) < (steps - 0.5) * step_ns) break;
  }
  return at;
}

std::string AccelerationSearch::too_many_looks_text(double length_ns) const {
  std::ostringstream text;
  text << "/scene/max_acceleration_mps2: with " << max_acceleration_mps2_ << " a frame of "
       << length_ns * 1e-6 << " ms has " << looks(length_ns)
       << " accelerations to search; more than " << most_looks
       << " take too long: lower it, or /frame/length_ms";
  return text.str();
}

}  // namespace splid
