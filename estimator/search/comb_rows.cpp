#include "estimator/search/comb_rows.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "estimator/fold/kernel_choice.hpp"

namespace splid {
namespace {

// Measured: to count one photon in one cell costs about as much as adding 20 cells of a row to
// those of another row.
constexpr std::size_t adds_per_increment = 20;

constexpr std::size_t chunk = 256;  // photons that are counted at a time

constexpr std::uint64_t most_fitting_bins = 1U << 20;
constexpr std::uint32_t most_slices = 1U << 16;

std::uint32_t to_32(double turns) {
  turns -= std::floor(turns);
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(turns * 0x1p32));
}

}  // namespace

SearchGrid SearchGrid::cover(double circle_ns, double bin_ns, double max_walk_ns,
                             std::uint32_t multiple_of) {
  SearchGrid grid;
  grid.bins = static_cast<std::uint32_t>(std::max(1.0, std::ceil(circle_ns / bin_ns)));
  const std::uint32_t whole = (grid.bins + multiple_of - 1) / multiple_of * multiple_of;
  if (whole <= grid.bins + grid.bins / 2) grid.bins = whole;
  grid.bin_ns = circle_ns / grid.bins;
  if (max_walk_ns > 0) {
    const double slices = std::min<double>(most_slices, std::ceil(max_walk_ns / grid.bin_ns) + 1);
    grid.slices = std::bit_ceil(static_cast<std::uint32_t>(std::max(2.0, slices)));
  }
  return grid;
}

CombRows::CombRows(const PulseTrain& train, std::size_t max_photons, const SearchKernels& kernels)
    : train_(train), kernels_(kernels) {
  for (const PulseTrain::Segment& segment : train.segments) parts_.push_back(parts_of(segment));
  for (const Part& part : parts_.front()) {
    if (train.single() && !part.taken_off) part_copies_.push_back(part.copies);
  }
  if (part_copies_.size() < 2) part_copies_.clear();
  part_bins_.reserve(part_copies_.size());
  moved_.reserve(max_photons);
  slice_.reserve(max_photons);
  in_slice_.reserve(most_slices);
}

std::vector<CombRows::Part> CombRows::parts_of(const PulseTrain::Segment& segment) {
  std::vector<Part> parts;
  const Comb& comb = segment.comb;
  std::vector<int> counted(comb.times_ns.size(), 0);  // how many parts have each pulse
  bool made_of_parts = !segment.subperiods_ns.empty();
  for (const double t_k : segment.subperiods_ns) {
    const double turns = std::round(comb.period_ns / t_k);
    const double tolerance_ns = 1e-6 * comb.period_ns;
    for (double n = 0; n < turns && made_of_parts; ++n) {
      const auto at =
          std::lower_bound(comb.times_ns.begin(), comb.times_ns.end(), n * t_k - tolerance_ns);
      made_of_parts = at != comb.times_ns.end() && *at <= n * t_k + tolerance_ns;
      if (made_of_parts) ++counted[static_cast<std::size_t>(at - comb.times_ns.begin())];
    }
    const auto copies = static_cast<std::uint32_t>(turns);
    parts.push_back({copies, copies, false, {0}, {}});
  }
  made_of_parts = made_of_parts && std::find(counted.begin(), counted.end(), 0) == counted.end();
  // The comb as a whole, or what its parts have too often.
  Part rest;
  rest.taken_off = made_of_parts;
  if (!made_of_parts) {
    rest.copies = segment.copies;
    parts.clear();
  }
  for (std::size_t p = 0; p < counted.size(); ++p) {
    const auto times = static_cast<std::size_t>(made_of_parts ? counted[p] - 1 : 1);
    rest.pulses_32.insert(rest.pulses_32.end(), times, to_32(comb.times_ns[p] / comb.period_ns));
  }
  parts.push_back(rest);
  for (Part& part : parts) {
    for (std::uint32_t copy = 0; copy < part.copies; ++copy) {
      for (const std::uint32_t pulse : part.pulses_32) {
        part.circle_32.push_back(to_32((pulse * 0x1p-32 + copy) / part.copies));
      }
    }
  }
  return parts;
}

std::uint32_t CombRows::fitting_bins() const {
  std::uint64_t bins = 1;
  for (const std::vector<Part>& parts : parts_) {
    for (const Part& part : parts) {
      if (part.copies > 0) bins = std::lcm(bins, std::uint64_t{part.copies});
      if (bins > most_fitting_bins) return 1;
    }
  }
  return static_cast<std::uint32_t>(bins);
}

void CombRows::load(const FoldedFrame& frame, double walk_ns, std::uint32_t slices) {
  frame_ = &frame;
  slope_ = walk_ns / frame.length_ns;
  phase_32_ = frame.phase_32.data();
  if (walk_ns != 0) {
    moved_.resize(frame.size());
    for (std::size_t s = 0; s < train_.segments.size(); ++s) {
      const std::size_t begin = frame.group_begin(s);
      kernels_.track_phases(
          moved_.data() + begin, frame.phase_32.data() + begin, frame.time_ns.data() + begin, 0,
          slope_ * 0x1p32 / train_.segments[s].comb.period_ns, 0, frame.group_end[s] - begin);
    }
    phase_32_ = moved_.data();
  }
  slice_.resize(frame.size());
  const double scale = slices / frame.length_ns;
  const auto last = static_cast<double>(slices - 1);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double at = std::clamp(frame.time_ns[i] * scale + 0.5 * slices, 0.0, last);
    slice_[i] = static_cast<std::uint32_t>(static_cast<std::int32_t>(at));
  }
  count_in_slices(slices);
}

// Most photons stand in the order in which they came, so that they are counted by runs.
void CombRows::count_in_slices(std::uint32_t slices) {
  in_slice_.assign(slices, 0);
  std::uint32_t run_slice = 0;
  std::uint32_t run = 0;
  for (const std::uint32_t slice : slice_) {
    if (slice != run_slice) {
      in_slice_[run_slice] += run;
      run_slice = slice;
      run = 0;
    }
    ++run;
  }
  in_slice_[run_slice] += run;
}

double CombRows::most_in_slice(double bin_ns) const {
  const double photons = *std::max_element(in_slice_.begin(), in_slice_.end());
  return photons * (1 + std::floor(bin_ns / train_.closest_ns));
}

// The copies of a part's period are added up side by side, where it is a whole number of bins.
template <class Count>
void CombRows::fill(const SearchGrid& grid, Count* rows, Count* histogram, Count* period) {
  std::fill_n(rows, grid.cells(), Count{0});
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    if (frame_->group_end[s] == frame_->group_begin(s)) continue;
    for (const Part& part : parts_[s]) {
      if (!fits_in_bins(grid, part.copies)) {
        fill_part(grid, s, part, rows, histogram);
        continue;
      }
      fill_period(grid, s, part, period, histogram);
      const std::size_t bins = grid.bins / part.copies;
      for (std::size_t begin = 0; begin < grid.cells(); begin += bins) {
        of<Count>(kernels_).accumulate(rows + begin, period + begin / grid.bins * bins, bins);
      }
    }
  }
  if (!train_.single()) count_between(grid, rows);
}

template void CombRows::fill(const SearchGrid&, std::uint8_t*, std::uint8_t*, std::uint8_t*);
template void CombRows::fill(const SearchGrid&, std::uint16_t*, std::uint16_t*, std::uint16_t*);
template void CombRows::fill(const SearchGrid&, std::uint32_t*, std::uint32_t*, std::uint32_t*);

template <class Count>
void CombRows::fill_period(const SearchGrid& grid, std::size_t part, Count* rows) {
  fill_period(grid, 0, parts_.front()[part], rows, static_cast<Count*>(nullptr));
}

template void CombRows::fill_period(const SearchGrid&, std::size_t, std::uint8_t*);
template void CombRows::fill_period(const SearchGrid&, std::size_t, std::uint16_t*);
template void CombRows::fill_period(const SearchGrid&, std::size_t, std::uint32_t*);

template <class Count>
void CombRows::fill_period(const SearchGrid& grid, std::size_t group, const Part& part, Count* rows,
                           Count* histogram) {
  std::fill_n(rows, std::size_t{grid.bins / part.copies} * grid.slices, Count{0});
  fill_part(grid, group, part, rows, histogram);
}

std::span<const std::uint32_t> CombRows::part_bins(const SearchGrid& grid) {
  part_bins_.clear();
  std::uint64_t all = 0;
  for (const std::uint32_t copies : part_copies_) {
    if (!fits_in_bins(grid, copies)) return {};
    part_bins_.push_back(grid.bins / copies);
    all += part_bins_.back();
  }
  if (all > grid.bins) return {};
  return part_bins_;
}

// Whether one of so many periods of a part is a whole number of bins, shorter than the circle.
bool CombRows::fits_in_bins(const SearchGrid& grid, std::uint32_t copies) {
  return copies > 1 && grid.bins % copies == 0;
}

// rows: one period of a part that stands beside others, and else the circle.
template <class Count>
void CombRows::fill_part(const SearchGrid& grid, std::size_t group, const Part& part, Count* rows,
                         Count* histogram) {
  // Where the part's period is no whole number of bins, its copies are counted one by one.
  const bool fits = grid.bins % part.copies == 0;
  const std::uint32_t bins = fits ? grid.bins / part.copies : grid.bins;
  const std::vector<std::uint32_t>& pulses = fits ? part.pulses_32 : part.circle_32;
  const std::size_t photons = frame_->group_end[group] - frame_->group_begin(group);
  const auto count = [&](std::span<const std::uint32_t> at, Count one, Count* to) {
    count_photons(group, {part.turns, fits ? 1 : part.copies, bins}, at, one, to);
  };
  if (part.taken_off || pulses.size() < 2 ||
      photons * adds_per_increment < std::size_t{bins} * grid.slices) {
    count(pulses, part.taken_off ? static_cast<Count>(-1) : Count{1}, rows);
  } else {
    constexpr std::uint32_t at_once = 0;
    std::fill_n(histogram, std::size_t{bins} * grid.slices, Count{0});
    count({&at_once, 1}, 1, histogram);
    add_shifted_rows(histogram, pulses, bins, grid.slices, rows);
  }
}

// Counts the photons of a group at the delays that each of the pulses gives them, a few hundred
// photons at a time: the rows that these lie in stay in the first-level cache.
template <class Count>
void CombRows::count_photons(std::size_t group, const RowScale& scale,
                             std::span<const std::uint32_t> pulses, Count one, Count* rows) const {
  std::array<std::uint32_t, chunk> phases, row_begins, cells;
  const std::size_t end = frame_->group_end[group];
  for (std::size_t begin = frame_->group_begin(group); begin < end; begin += chunk) {
    const std::size_t count = std::min(chunk, end - begin);
    for (std::size_t i = 0; i < count; ++i) {
      phases[i] = phase_32_[begin + i] * scale.turns;
      row_begins[i] = slice_[begin + i] * scale.bins;
    }
    if (scale.copies > 1) {
      for (std::uint32_t& phase : std::span(phases).first(count)) phase /= scale.copies;
    }
    for (const std::uint32_t pulse : pulses) {
      kernels_.delay_cells(cells.data(), row_begins.data(), phases.data(), pulse, count,
                           scale.bins);
      for (std::size_t i = 0; i < count; ++i) {
        rows[cells[i]] = static_cast<Count>(rows[cells[i]] + one);
      }
    }
  }
}

// Adds one row of all photons, shifted by each pulse: a target's photons spread over two or three
// bins, but the cost does not grow with the number of photons.
template <class Count>
void CombRows::add_shifted_rows(const Count* histogram, std::span<const std::uint32_t> pulses,
                                std::uint32_t bins, std::size_t slices, Count* rows) const {
  for (std::size_t slice = 0; slice < slices; ++slice) {
    const Count* from = histogram + slice * bins;
    Count* row = rows + slice * bins;
    for (const std::uint32_t pulse : pulses) {
      const std::size_t shift = ((std::uint64_t{pulse} * bins + 0x80000000U) >> 32) % bins;
      of<Count>(kernels_).accumulate(row, from + shift, bins - shift);
      of<Count>(kernels_).accumulate(row + (bins - shift), from, shift);
    }
  }
}

// Counts the photons that may have left in one of several segments, at every pulse that left
// within the last circle of delays.
template <class Count>
void CombRows::count_between(const SearchGrid& grid, Count* rows) {
  const double bins_per_ns = grid.bins / train_.circle_ns;
  const std::size_t segments = train_.segments.size();
  for (std::size_t i = frame_->group_begin(segments); i < frame_->size(); ++i) {
    Count* row = rows + std::size_t{slice_[i]} * grid.bins;
    double came = frame_->phase_ns[i] - slope_ * frame_->time_ns[i];
    came -= train_.period_ns * std::floor(came / train_.period_ns);
    const double earliest = came - train_.circle_ns;
    std::size_t s = train_.segment_at(came);
    double turn_ns = 0;  // begin of the pattern period that the segment is in
    while (turn_ns + train_.segments[s].end_ns > earliest) {
      const PulseTrain::Segment& segment = train_.segments[s];
      const double begin = turn_ns + segment.begin_ns;
      const double end = std::min(came, turn_ns + segment.end_ns);
      const double period = segment.comb.period_ns;
      for (const double time_ns : segment.comb.times_ns) {
        const double first = begin + time_ns;
        double n = std::max(0.0, std::floor((earliest - first) / period) + 1);
        for (; first + n * period <= end; ++n) {
          const double delay_bin = (came - first - n * period) * bins_per_ns;
          const auto cell = static_cast<std::size_t>(std::max(0.0, delay_bin));
          if (cell < grid.bins) row[cell] = static_cast<Count>(row[cell] + 1);
        }
      }
      if (s == 0) turn_ns -= train_.period_ns;
      s = (s == 0 ? segments : s) - 1;
    }
  }
}

}  // namespace splid
