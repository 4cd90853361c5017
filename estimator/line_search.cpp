#include "estimator/line_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "estimator/search_dispatch.hpp"

namespace splid {
namespace {

// Measured: an increment costs about as much as adding 20 counts of a row to another's.
constexpr std::size_t adds_per_increment = 20;

template <class Count>
struct Kernels;
template <>
struct Kernels<std::uint16_t> {
  static auto add(const SearchKernels& k) { return k.add; }
  static auto largest(const SearchKernels& k) { return k.largest; }
};
template <>
struct Kernels<std::uint32_t> {
  static auto add(const SearchKernels& k) { return k.add_32; }
  static auto largest(const SearchKernels& k) { return k.largest_32; }
};

// out[d] = a[d] + b[(d + shift) mod bins], 0 <= shift < bins.
template <class Count, class Add>
void add_shifted(Add add, Count* out, const Count* a, const Count* b, std::size_t shift,
                 std::size_t bins) {
  add(out, a, b + shift, bins - shift);
  add(out + (bins - shift), a + (bins - shift), b, shift);
}

// Adds the slices along all lines that drift 0, 1, ... most bins in the direction of `sign` from
// the first slice to the last. Row j of the result drifts j bins; it lies in one of the two
// buffers.
//
// A line of j bins over 2n slices is one of floor(j/2) over the first n and one of floor(j/2) over
// the last n that starts ceil(j/2) further on.
template <class Count, class Add>
const Count* taylor_tree(Add add, const Count* slices, Count* one, Count* other,
                         const SearchGrid& grid, int sign, std::size_t most) {
  const std::size_t bins = grid.bins;
  const Count* in = slices;
  Count* out = one;
  auto levels = static_cast<std::size_t>(std::countr_zero(grid.slices));
  for (std::size_t half = 1; half < grid.slices; half *= 2) {
    --levels;
    const std::size_t lines = std::min(2 * half, (most >> levels) + 1);
    for (std::size_t group = 0; group < grid.slices; group += 2 * half) {
      for (std::size_t j = 0; j < lines; ++j) {
        const std::size_t ahead = ((j + 1) / 2) % bins;
        const std::size_t shift = sign > 0 ? ahead : (bins - ahead) % bins;
        add_shifted(add, out + (group + j) * bins, in + (group + j / 2) * bins,
                    in + (group + half + j / 2) * bins, shift, bins);
      }
    }
    in = out;
    out = out == one ? other : one;
  }
  return in;
}

std::size_t slice_of(double time_ns, double length_ns, std::uint32_t slices) {
  const double position = (time_ns / length_ns + 0.5) * slices;
  const auto last = static_cast<double>(slices - 1);
  return static_cast<std::size_t>(std::clamp(position, 0.0, last));
}

}  // namespace

SearchGrid SearchGrid::cover(double period_ns, double bin_ns, double max_drift_ns) {
  SearchGrid grid;
  grid.bins = static_cast<std::uint32_t>(std::max(1.0, std::ceil(period_ns / bin_ns)));
  grid.bin_ns = period_ns / grid.bins;
  if (max_drift_ns > 0) {
    const double slices = std::ceil(max_drift_ns / grid.bin_ns) + 1;
    grid.slices = std::bit_ceil(static_cast<std::uint32_t>(std::max(2.0, slices)));
  }
  return grid;
}

LineSearch::LineSearch(const Comb& comb, std::size_t max_photons, std::size_t max_grid_cells,
                       VectorLevel level)
    : comb_(comb), level_(level), max_grid_cells_(max_grid_cells) {
  for (const double time_ns : comb.times_ns) {
    pulses_32_.push_back(
        static_cast<std::uint32_t>(static_cast<std::uint64_t>(time_ns / comb.period_ns * 0x1p32)));
  }
  cells_.resize(pulses_32_.size());
  memory_.resize(3 * max_grid_cells);
  phases_.reserve(max_photons);
  best_.reserve(max_cells + 1);
}

template <class Count>
Count* LineSearch::buffer(std::size_t which) {
  static_assert(std::is_same_v<Count, std::uint32_t> || std::is_same_v<Count, std::uint16_t>);
  // Either count type lives in the same memory; rows are written before they are read.
  return reinterpret_cast<Count*>(memory_.data() + which * max_grid_cells_);
}

std::span<const SearchCell> LineSearch::run(const FoldedFrame& frame, const SearchGrid& grid,
                                            double max_drift_ns) {
  best_.clear();
  // A cell holds at most every photon, once for each pulse that shares a bin with another.
  const double per_photon = 1 + std::floor(grid.bin_ns / comb_.closest_ns);
  if (static_cast<double>(frame.size()) * per_photon < 65536) {
    search<std::uint16_t>(frame, grid, max_drift_ns);
  } else {
    search<std::uint32_t>(frame, grid, max_drift_ns);
  }
  return best_;
}

template <class Count>
void LineSearch::search(const FoldedFrame& frame, const SearchGrid& grid, double max_drift_ns) {
  const SearchKernels& kernel = search_kernels(level_);
  const auto add = Kernels<Count>::add(kernel);
  const auto largest = Kernels<Count>::largest(kernel);
  Count* slices = buffer<Count>(0);
  if (frame.size() * adds_per_increment < grid.cells() || pulses_32_.size() < 2) {
    fill_by_photon(frame, grid, slices);
  } else {
    fill_by_row(frame, grid, slices);
  }
  const auto most = static_cast<std::size_t>(
      std::min<double>(grid.slices - 1, std::ceil(max_drift_ns / grid.bin_ns)));
  for (const int sign : {1, -1}) {
    const Count* lines =
        taylor_tree(add, slices, buffer<Count>(1), buffer<Count>(2), grid, sign, most);
    // Drift 0 is in both halves: look at it once.
    for (std::size_t j = sign > 0 ? 0 : 1; j <= most; ++j) {
      const Count* row = lines + j * grid.bins;
      if (best_.size() < max_cells || largest(row, grid.bins) > best_.back().count) {
        keep_best(row, grid, sign * static_cast<int>(j));
      }
    }
  }
}

template <class Count>
void LineSearch::fill_by_photon(const FoldedFrame& frame, const SearchGrid& grid, Count* rows) {
  std::memset(rows, 0, grid.cells() * sizeof(Count));
  const auto delay_bins = search_kernels(level_).delay_bins;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    Count* row = rows + slice_of(frame.time_ns[i], frame.length_ns, grid.slices) * grid.bins;
    delay_bins(cells_.data(), frame.phase_32[i], pulses_32_.data(), pulses_32_.size(), grid.bins);
    for (const std::uint32_t cell : cells_) ++row[cell];
  }
}

// One histogram a slice, then the comb by adding shifted copies of it. A pulse's shift is rounded
// to bins, so a target's photons spread over two or three; what is gained is that the number of
// photons no longer matters.
template <class Count>
void LineSearch::fill_by_row(const FoldedFrame& frame, const SearchGrid& grid, Count* rows) {
  const auto add = Kernels<Count>::add(search_kernels(level_));
  const std::size_t bins = grid.bins;
  Count* histograms = buffer<Count>(1);
  std::memset(histograms, 0, grid.cells() * sizeof(Count));
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const auto bin = (static_cast<std::uint64_t>(frame.phase_32[i]) * bins) >> 32;
    ++histograms[slice_of(frame.time_ns[i], frame.length_ns, grid.slices) * bins + bin];
  }
  Count* swap = buffer<Count>(2);
  for (std::size_t slice = 0; slice < grid.slices; ++slice) {
    const Count* histogram = histograms + slice * bins;
    Count* result = rows + slice * bins;
    // Ends in `result` whichever number of pulses there is.
    Count* to = pulses_32_.size() % 2 == 1 ? result : swap;
    Count* from = pulses_32_.size() % 2 == 1 ? swap : result;
    std::memset(from, 0, bins * sizeof(Count));
    for (const std::uint32_t pulse : pulses_32_) {
      const auto shift = (static_cast<std::uint64_t>(pulse) * bins + 0x80000000U) >> 32;
      add_shifted(add, to, from, histogram, shift % bins, bins);
      std::swap(to, from);
    }
  }
}

template <class Count>
void LineSearch::keep_best(const Count* row, const SearchGrid& grid, int drift_bins) {
  const double per_gap = grid.slices > 1 ? grid.slices / (grid.slices - 1.0) : 0.0;
  for (std::size_t d = 0; d < grid.bins; ++d) {
    const std::uint32_t least = best_.size() < max_cells ? 0 : best_.back().count;
    if (row[d] <= least) continue;
    // Bin d is where the line crosses the first slice's middle; it moves by drift_bins to the
    // last's.
    const double delay_ns = (static_cast<double>(d) + 0.5 + drift_bins / 2.0) * grid.bin_ns;
    const double turn = std::floor(delay_ns / comb_.period_ns);
    keep({{delay_ns - turn * comb_.period_ns, drift_bins * per_gap * grid.bin_ns}, row[d]},
         grid.bin_ns);
  }
}

void LineSearch::keep(const SearchCell& cell, double bin_ns) {
  const auto same_target = [&](const SearchCell& other) {
    double apart = std::abs(cell.line.delay_ns - other.line.delay_ns);
    apart = std::min(apart, comb_.period_ns - apart);
    // A line through a target's photons at the wrong drift holds some of them in each of its bins:
    // the target shows as a bow tie, as wide in delay as half the drift's error.
    const double off = std::abs(cell.line.drift_ns - other.line.drift_ns);
    return off < 16.2 * bin_ns && apart < 2.2 * bin_ns + off / 2;
  };
  for (const SearchCell& other : best_) {
    if (other.count >= cell.count && same_target(other)) return;
  }
  std::erase_if(best_, same_target);
  const auto place = std::find_if(best_.begin(), best_.end(), [&](const SearchCell& other) {
    return other.count < cell.count;
  });
  best_.insert(place, cell);
  if (best_.size() > max_cells) best_.pop_back();
}

SearchCell LineSearch::best_delay(const FoldedFrame& frame, double drift_ns, std::uint32_t bins) {
  const auto add = Kernels<std::uint32_t>::add(search_kernels(level_));
  auto* histogram = buffer<std::uint32_t>(0);
  auto* from = buffer<std::uint32_t>(1);
  auto* to = buffer<std::uint32_t>(2);
  std::memset(histogram, 0, bins * sizeof(std::uint32_t));
  std::memset(from, 0, bins * sizeof(std::uint32_t));
  const double to_32 = 0x1p32 / comb_.period_ns;
  phases_.resize(frame.size());
  search_kernels(level_).line_phases(phases_.data(), frame.phase_32.data(), frame.time_ns.data(), 0,
                                     drift_ns / frame.length_ns * to_32, frame.size());
  for (const std::uint32_t phase : phases_) {
    ++histogram[(static_cast<std::uint64_t>(phase) * bins) >> 32];
  }
  for (const std::uint32_t pulse : pulses_32_) {
    const auto shift = (static_cast<std::uint64_t>(pulse) * bins + 0x80000000U) >> 32;
    add_shifted(add, to, from, histogram, shift % bins, bins);
    std::swap(to, from);
  }
  const auto* most = std::max_element(from, from + bins);
  const double delay_ns = (static_cast<double>(most - from) + 0.5) * comb_.period_ns / bins;
  return {{delay_ns, drift_ns}, *most};
}

}  // namespace splid
