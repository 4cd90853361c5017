#include "estimator/checks/residual_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "estimator/fold/kernel_choice.hpp"
#include "estimator/model/units.hpp"

namespace splid::checks {
namespace {

constexpr int map_steps_a_width = 2;
constexpr int most_map_steps = 64;
// Edges of cells, in steps from the peak on either side.
constexpr int cell_edges[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 15, 17, 22, 27, 32};
constexpr int widths_a_phase = 8;  // of a phase bin
constexpr std::size_t most_phases = 4096;
constexpr std::size_t fewest_map_steps = 12;  // three widths on both sides

}  // namespace

ResidualMap::ResidualMap(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons)
    : train_(train),
      step_ns_(shape.width_ns() / map_steps_a_width),
      peak_ns_(shape.peak_offset_ns()),
      half_pulse_ns_(half_pulse_widths * shape.width_ns()) {
  const double most = std::floor(0.499 * train.closest_ns / step_ns_);
  const auto steps = 2 * static_cast<std::size_t>(std::min(most, most_map_steps / 2.0));
  if (steps < fewest_map_steps) return;
  steps_ = steps;
  first_ns_ = peak_ns_ - reach_ns();
  add_cells();
  windows_ = comb_windows(train, first_ns_, first_ns_ + 2 * reach_ns());
  counts_.resize(map_parts * most_cells);
  phases_32_.reserve(max_photons);
  picked_.reserve(max_photons);
  if (!train.single()) return;
  by_pulse_.resize(train.segments.front().comb.times_ns.size());
  add_phases(shape);
}

void ResidualMap::add_cells() {
  const std::size_t half = steps_ / 2;
  for (std::size_t step = 0; step <= steps_; ++step) {
    const std::size_t off = step < half ? half - step : step - half;  // from the peak
    const auto* edge = std::find(std::begin(cell_edges), std::end(cell_edges), off);
    if (edge != std::end(cell_edges) || off == half) {
      edges_ns_.push_back(first_ns_ + static_cast<double>(step) * step_ns_);
    }
    if (step < steps_) cell_of_step_.at(step) = static_cast<std::uint8_t>(edges_ns_.size() - 1);
  }
  cells_ = edges_ns_.size() - 1;
}

void ResidualMap::add_phases(const PulseShape& shape) {
  const Comb& comb = train_.segments.front().comb;
  const double wish = std::ceil(comb.period_ns / (widths_a_phase * shape.width_ns()));
  const auto bins = std::min(
      most_phases, std::bit_floor(std::max<std::size_t>(2, static_cast<std::size_t>(wish))));
  const double bin_ns = comb.period_ns / static_cast<double>(bins);
  is_free_.assign(bins, 1);
  const double before_ns = std::max(-shape.first_ns(), -first_ns_);
  const double after_ns = std::max(shape.last_ns(), first_ns_ + 2 * reach_ns());
  for (const double time_ns : comb.times_ns) {
    const auto first = static_cast<std::int64_t>(std::floor((time_ns - before_ns) / bin_ns));
    const auto last = static_cast<std::int64_t>(std::floor((time_ns + after_ns) / bin_ns));
    for (std::int64_t bin = first; bin <= last; ++bin) {
      is_free_[static_cast<std::size_t>(bin) & (bins - 1)] = 0;  // a power of two: negative wraps
    }
  }
  by_phase_.resize(bins);
  phase_shift_ = 32 - std::countr_zero(bins);
}

void ResidualMap::fill(const FoldedFrame& frame, const DelayTrack& track) {
  if (!looks()) return;
  phases_32_.resize(frame.size());
  picked_.resize(frame.size());
  std::fill(counts_.begin(), counts_.end(), 0.0);
  std::fill(by_pulse_.begin(), by_pulse_.end(), 0.0);
  std::fill(by_phase_.begin(), by_phase_.end(), 0);
  near_ = 0;
  for (std::size_t s = 0; s < train_.segments.size(); ++s) fill_segment(frame, track, s);
  if (!train_.single()) fill_between(frame, track);
  elsewhere_ = static_cast<double>(frame.size()) - near_;
}

// Phases in 2^-32 of a period are exact to a millionth of a width.
void ResidualMap::fill_segment(const FoldedFrame& frame, const DelayTrack& track, std::size_t s) {
  const SearchKernels& kernels = best_search_kernels();
  const std::size_t begin = frame.group_begin(s), count = frame.group_end[s] - begin;
  const double period_ns = train_.segments[s].comb.period_ns;
  const double to_32 = 0x1p32 / period_ns, per_ns = 1 / frame.length_ns;
  std::uint32_t* phases = phases_32_.data() + begin;
  kernels.track_phases(phases, frame.phase_32.data() + begin, frame.time_ns.data() + begin,
                       std::remainder(track.at_mid_frame_ns(), period_ns) * to_32,
                       track.walk_ns * per_ns * to_32,
                       6 * track.quadratic_ns * per_ns * per_ns * to_32, count);
  if (!by_phase_.empty()) {
    for (std::size_t i = 0; i < count; ++i) ++by_phase_[phases[i] >> phase_shift_];
  }
  const CombWindow& window = windows_[s];
  const std::size_t near =
      kernels.pick(picked_.data(), phases, window.flags(), window.shift(), count);
  const double to_ns = 1 / to_32;
  for (std::size_t n = 0; n < near; ++n) {
    const std::size_t i = picked_[n];
    this->count(phases[i] * to_ns, frame.time_ns[begin + i] * per_ns, window, phases[i]);
  }
}

// The photons of the last group: the track tells when they left, and so in which segment.
void ResidualMap::fill_between(const FoldedFrame& frame, const DelayTrack& track) {
  const double per_ns = 1 / frame.length_ns;
  for (std::size_t i = frame.group_begin(train_.segments.size()); i < frame.size(); ++i) {
    const double share = frame.time_ns[i] * per_ns;
    const PulseTrain::Place at =
        train_.place_of(fold_on(frame.phase_ns[i] - track.at(share), train_.period_ns));
    count(at.turns * train_.segments[at.segment].comb.period_ns, share, windows_[at.segment],
          at.phase_32());
  }
}

void ResidualMap::count(double phase_ns, double share, const CombWindow& window,
                        std::uint32_t phase_32) {
  for (const CombWindow::Pulse& pulse : window.candidates(phase_32)) {
    const double offset_ns = phase_ns - pulse.time_ns;
    const double step = (offset_ns - first_ns_) / step_ns_;
    if (!(step >= 0) || step >= static_cast<double>(steps_)) continue;
    const std::size_t cell = cell_of_step_[static_cast<std::size_t>(step)];
    const double part = std::clamp((share + 0.5) * map_parts, 0.0, map_parts - 1.0);
    counts_[static_cast<std::size_t>(part) * most_cells + cell] += 1;
    near_ += 1;
    if (by_pulse_.empty() || std::abs(offset_ns - peak_ns_) > half_pulse_ns_) return;
    by_pulse_[window.index_of(pulse)] += 1;
    return;
  }
}

}  // namespace splid::checks
