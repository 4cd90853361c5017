#include "estimator/fold/near_set.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/fold/kernel_choice.hpp"
#include "estimator/sync/round_quickly.hpp"

namespace splid {
namespace {

constexpr std::size_t gathered_rows = 32;
constexpr std::size_t most_cells = 16384;
constexpr std::size_t most_columns = most_cells / gathered_rows;

double columns_of(const CombWindow& window, double width_ns) {
  return std::floor((window.last_ns() - window.first_ns()) * NearSet::cells_a_width / width_ns) + 1;
}

// Whether no photon is near two pulses, and all pulses have the same amplitude, so that the photons
// differ in residual and time alone.
bool each_photon_has_one_pulse(std::span<const CombWindow> windows) {
  const double amplitude = windows.front().uniform_amplitude();
  return amplitude > 0 &&
         std::all_of(windows.begin(), windows.end(), [&](const CombWindow& window) {
           return window.uniform_amplitude() == amplitude && window.max_overlap() <= 1;
         });
}

}  // namespace

// The set's track, by the time from mid-frame.
struct NearSet::Curve {
  double mid_ns;  // delay at mid-frame
  double slope, curve;

  Curve(const NearSet& set, double length_ns)
      : mid_ns(set.track.at_mid_frame_ns()),
        slope(set.track.walk_ns / length_ns),
        curve(6 * set.track.quadratic_ns / (length_ns * length_ns)) {}
  // When light left that came at a phase.
  [[nodiscard]] double left(double phase_ns, double time_ns) const {
    return phase_ns - mid_ns - slope * time_ns - curve * time_ns * time_ns;
  }
};

NearSet::NearSet(std::size_t max_photons, std::size_t max_entries, bool notes_index)
    : notes_index_(notes_index) {
  if (notes_index) index.reserve(max_photons);
  residual_ns.reserve(max_entries);
  position.reserve(max_entries);
  amplitude.reserve(max_entries);
  first.reserve(max_photons + 1);
  weight.reserve(max_photons);
  if (max_photons >= gathered_roughly_from) cells_.reserve(most_cells);
  phase_32_.reserve(max_photons);
  picked_.reserve(max_photons);
  picks_.reserve(256);
}

void NearSet::collect(const FoldedFrame& frame, std::span<const CombWindow> windows,
                      const PulseTrain& train, const DelayTrack& about, double gather_width_ns,
                      std::size_t gather_from) {
  track = about;
  beyond_ = 0;
  residual_ns.clear();
  position.clear();
  amplitude.clear();
  first.clear();
  weight.clear();
  index.clear();
  likely_near = pick_groups(frame, windows, train);
  gathers = gather_width_ns > 0 && likely_near >= gather_from &&
            columns_of(windows.front(), gather_width_ns) <= static_cast<double>(most_columns) &&
            each_photon_has_one_pulse(windows);
  if (gathers) {
    gather_photons(frame, windows, train, gather_width_ns);
  } else {
    take_photons(frame, windows, train);
    weight.assign(first.size(), 1.0);
  }
  first.push_back(static_cast<std::uint32_t>(residual_ns.size()));
}

void NearSet::straighten(double quadratic_ns) {
  for (std::size_t j = 0; j < entries(); ++j) {
    residual_ns[j] -= quadratic_ns * DelayTrack::quadratic_at(position[j]);
  }
}

// Notes which photons of each segment may be near the line, and returns how many these are.
std::size_t NearSet::pick_groups(const FoldedFrame& frame, std::span<const CombWindow> windows,
                                 const PulseTrain& train) {
  const SearchKernels& kernels = best_search_kernels();
  const Curve curve(*this, frame.length_ns);
  phase_32_.resize(frame.size());
  picked_.resize(frame.size());
  picks_.clear();
  std::size_t sum = 0;
  for (std::size_t s = 0; s < train.segments.size(); ++s) {
    const std::size_t begin = frame.group_begin(s);
    const std::size_t count = frame.group_end[s] - begin;
    const double period_ns = train.segments[s].comb.period_ns;
    const double to_32 = 0x1p32 / period_ns;
    kernels.track_phases(phase_32_.data() + begin, frame.phase_32.data() + begin,
                         frame.time_ns.data() + begin,
                         std::remainder(curve.mid_ns, period_ns) * to_32, curve.slope * to_32,
                         curve.curve * to_32, count);
    picks_.push_back(kernels.pick(picked_.data() + begin, phase_32_.data() + begin,
                                  windows[s].flags(), windows[s].shift(), count));
    sum += picks_.back();
  }
  return sum;
}

template <class Add>
void NearSet::visit_near(const FoldedFrame& frame, std::span<const CombWindow> windows,
                         const PulseTrain& train, const Add& add) const {
  const Curve curve(*this, frame.length_ns);
  for (std::size_t s = 0; s < train.segments.size(); ++s) {
    const std::size_t begin = frame.group_begin(s);
    const double begin_ns = train.segments[s].begin_ns;
    const double period_ns = train.segments[s].comb.period_ns;
    const double to_32 = 0x1p32 / period_ns;
    const double turns_per_ns = 1 / period_ns;
    // The integer phases, in 2^-32 of a period, tell which photons are near and on which turn. The
    // residual itself comes from doubles, which are good to 1e-16.
    for (std::size_t n = 0; n < picks_[s]; ++n) {
      const std::size_t i = begin + picked_[begin + n];
      const std::uint32_t phase_32 = phase_32_[i];
      const double coarse = phase_32 / to_32;
      const double apart = curve.left(frame.phase_ns[i] - begin_ns, frame.time_ns[i]) - coarse;
      add(i, coarse + (apart - period_ns * round_quickly(apart * turns_per_ns)),
          windows[s].candidates(phase_32), windows[s]);
    }
  }
  if (!train.single()) visit_between(frame, windows, train, add);
}

// The photons of the last group: the line tells when they left, and so in which segment.
template <class Add>
void NearSet::visit_between(const FoldedFrame& frame, std::span<const CombWindow> windows,
                            const PulseTrain& train, const Add& add) const {
  const Curve curve(*this, frame.length_ns);
  for (std::size_t i = frame.group_begin(train.segments.size()); i < frame.size(); ++i) {
    double left = curve.left(frame.phase_ns[i], frame.time_ns[i]);
    left -= train.period_ns * std::floor(left / train.period_ns);
    const PulseTrain::Place at = train.place_of(left);
    const CombWindow& window = windows[at.segment];
    add(i, at.turns * train.segments[at.segment].comb.period_ns, window.candidates(at.phase_32()),
        window);
  }
}

// Design note: entries are written where they belong, and counted. To push each to the back of its
// vector takes half as long again.
void NearSet::take_photons(const FoldedFrame& frame, std::span<const CombWindow> windows,
                           const PulseTrain& train) {
  std::size_t between = 0;
  if (!train.single()) between = frame.size() - frame.group_begin(train.segments.size());
  const std::size_t most = likely_near + between;
  for (auto* values : {&residual_ns, &position, &amplitude}) {
    values->resize(most * widest_overlap(windows));
  }
  first.resize(most);
  if (notes_index_) index.resize(most);
  std::size_t entries = 0, photons = 0;
  double beyond = 0;
  visit_near(frame, windows, train,
             [&](std::size_t photon, double phase_ns, std::span<const CombWindow::Pulse> pulses,
                 const CombWindow& window) {
               const std::size_t before = entries;
               for (const CombWindow::Pulse& pulse : pulses) {
                 const double residual = phase_ns - pulse.time_ns;
                 if (residual > window.last_ns()) beyond += pulse.amplitude;
                 if (residual < window.first_ns() || residual > window.last_ns()) continue;
                 residual_ns[entries] = residual;
                 position[entries] = frame.time_ns[photon] / frame.length_ns;
                 amplitude[entries] = pulse.amplitude;
                 ++entries;
               }
               if (entries == before) return;
               first[photons] = static_cast<std::uint32_t>(before);
               if (notes_index_) index[photons] = static_cast<std::uint32_t>(photon);
               ++photons;
             });
  beyond_ = beyond;
  for (auto* values : {&residual_ns, &position, &amplitude}) values->resize(entries);
  first.resize(photons);
  if (notes_index_) index.resize(photons);
}

// The photons are added up in cells, whose rows go along the frame and columns across the window.
void NearSet::gather_photons(const FoldedFrame& frame, std::span<const CombWindow> windows,
                             const PulseTrain& train, double width_ns) {
  const double columns_per_ns = cells_a_width / width_ns;
  const double rows_per_ns = gathered_rows / frame.length_ns;
  const auto columns = static_cast<std::size_t>(columns_of(windows.front(), width_ns));
  cells_.assign(columns * gathered_rows, {});
  visit_near(
      frame, windows, train,
      [&](std::size_t photon, double phase_ns, std::span<const CombWindow::Pulse> pulses,
          const CombWindow& window) {
        if (pulses.empty()) return;
        const double residual = phase_ns - pulses.front().time_ns;
        if (residual > window.last_ns()) beyond_ += pulses.front().amplitude;
        if (residual < window.first_ns() || residual > window.last_ns()) return;
        const double rows = frame.time_ns[photon] * rows_per_ns;  // from mid-frame
        const double row = std::clamp(rows + 0.5 * gathered_rows, 0.0, gathered_rows - 1.0);
        const double column = (residual - window.first_ns()) * columns_per_ns;
        Cell& cell =
            cells_[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
        cell.weight += 1;
        cell.residual += residual;
        cell.position += rows;
      });
  for (const Cell& cell : cells_) {
    if (cell.weight == 0) continue;
    first.push_back(static_cast<std::uint32_t>(residual_ns.size()));
    residual_ns.push_back(cell.residual / cell.weight);
    position.push_back(cell.position / (cell.weight * gathered_rows));
    amplitude.push_back(windows.front().uniform_amplitude());
    weight.push_back(cell.weight);
  }
}

NearSet::Passed NearSet::passed(const FoldedFrame& frame, std::span<const CombWindow> windows,
                                const PulseTrain& train) const {
  Passed sum;
  sum.amplitude = beyond_;
  for (std::size_t s = 0; s < train.segments.size(); ++s) {
    const CombWindow& window = windows[s];
    const std::span phases = std::span(phase_32_).subspan(
        frame.group_begin(s), frame.group_end[s] - frame.group_begin(s));
    const double to_32 = 0x1p32 / train.segments[s].comb.period_ns;
    const double mean_ns =
        static_cast<double>(std::accumulate(phases.begin(), phases.end(), std::uint64_t{0})) /
        to_32;
    sum.amplitude += window.amplitude_before(phases) - window.amplitude_per_ns() * mean_ns;
    sum.amplitude_per_ns += window.amplitude_per_ns() * static_cast<double>(phases.size());
  }
  if (train.single()) return sum;
  visit_between(frame, windows, train,
                [&](std::size_t, double phase_ns, std::span<const CombWindow::Pulse> pulses,
                    const CombWindow& window) {
                  sum.amplitude +=
                      window.amplitude_before(pulses) - window.amplitude_per_ns() * phase_ns;
                  sum.amplitude_per_ns += window.amplitude_per_ns();
                });
  return sum;
}

}  // namespace splid
