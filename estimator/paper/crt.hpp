#pragma once

#include <span>

namespace splid::paper {

// What one repetition period tells of a delay: the delay less an unknown number of whole periods.
struct Remainder {
  double value_ns = 0;    // any value; usually in [0, modulus)
  double modulus_ns = 0;  // > 0
  double weight = 1;      // > 0; 1 / variance, on a scale that all remainders share
};

// Which of the two theorems below makes a delay of the remainders.
enum class RemainderTheorem { mixed_integer, wang };
// [P] rounds the periods to whole nanoseconds for the theorem of Wang et al.
constexpr double wang_unit_ns = 1;

struct CrtSolution {
  bool found = false;
  double value_ns = 0;  // in [0, limit]; with the method of Wang in [0, least common multiple)
  double cost = 0;      // sum of weight * (value - turns * modulus - remainder)^2
};

// The delay in [0, limit_ns] that agrees best with all remainders: the mixed-integer program of [P]
// Eq. 16 to 18, min over tau and whole n_k of sum_k w_k (tau - n_k t_k - tau_k)^2, for any real
// moduli. Exact: the best n_k, round((tau - tau_k) / t_k), changes only at breakpoints of tau, and
// between two of these the cost is a parabola. Cost: K times their number, the sum of limit / t_k.
//
// Errors: not found for fewer than two remainders, for values that are not finite, or for more than
// 1e8 breakpoints (10 s).
CrtSolution crt_mixed_integer(std::span<const Remainder> remainders, double limit_ns);

// The robust Chinese remainder theorem of Wang, Li, Wang and Xia, "Maximum likelihood estimation
// based robust Chinese remainder theorem for real numbers and its fast algorithm", IEEE Trans.
// Signal Process. 63 (2015), for moduli M Gamma_k with pairwise coprime integers Gamma_k. It is
// right as long as remainders err by less than M / 4. Moduli are rounded to multiples of unit_ns
// first, which every turn adds to the error: with 99.9 and 104.1 ns it fails from ten turns (1000
// ns) on, as [P] Fig. 5 shows.
//
// Errors: not found for fewer than two remainders, for ratios that are not pairwise coprime, or for
// a least common multiple above 2^53 units.
CrtSolution crt_wang(std::span<const Remainder> remainders, double unit_ns);

}  // namespace splid::paper
