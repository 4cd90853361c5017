#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace splid::tradeoff {

struct Interval {
  double low = 0;
  double high = 0;
};

// So many equal blocks of frames in a row tell how far a mean square scatters.
constexpr std::size_t interval_blocks = 10;

// The interval that holds the true root mean square in 95 of 100 measurements, as factors of the
// measured one. mean_square: > 0. without: the mean square without each block of errors in turn.
// shared: the part of the mean square's variance that is between blocks, in [0, 1). Absent for
// fewer than three blocks, and where the mean square scatters so much that it has no upper end.
//
// Design note: the jackknife's variance of the mean square gives the degrees of freedom of a
// chi-square distribution. Its quantiles are those of Wilson and Hilferty (1931), with Student's t
// for the few blocks. Blocks make this right for errors that depend on one another, as those
// against neighbouring frames do, and for errors with long tails.
std::optional<Interval> interval_of_rms(double mean_square, std::span<const double> without,
                                        double shared = 0);

}  // namespace splid::tradeoff
