#pragma once

#include <span>

namespace splid::paper {

// What one repetition period tells of a delay: the delay less an unknown number of whole periods.
struct Remainder {
  double value_ns = 0;    // any value; usually in [0, modulus)
  double modulus_ns = 0;  // > 0
  double weight = 1;      // > 0; 1 / variance, on a scale that all remainders share
};

struct CrtSolution {
  bool found = false;
  double value_ns = 0;  // in [0, limit]
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

// A theorem that makes a delay of the remainders; [P] has two. limit_ns: the largest delay sought.
using RemainderTheorem = CrtSolution (*)(std::span<const Remainder> remainders, double limit_ns);

// Whether there are two or more, of finite values and weights above zero.
bool are_usable(std::span<const Remainder> remainders);

}  // namespace splid::paper
