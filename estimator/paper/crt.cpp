#include "estimator/paper/crt.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace splid::paper {
namespace {

// The best tau in [from_ns, to_ns] for given numbers of turns.
CrtSolution best_between(std::span<const Remainder> remainders, const std::vector<double>& turns,
                         double from_ns, double to_ns) {
  double weights = 0;
  double moment = 0;
  for (std::size_t k = 0; k < remainders.size(); ++k) {
    weights += remainders[k].weight;
    moment += remainders[k].weight * (remainders[k].value_ns + turns[k] * remainders[k].modulus_ns);
  }
  CrtSolution best;
  best.found = true;
  best.value_ns = std::clamp(moment / weights, from_ns, to_ns);
  for (std::size_t k = 0; k < remainders.size(); ++k) {
    const double off = best.value_ns - turns[k] * remainders[k].modulus_ns - remainders[k].value_ns;
    best.cost += remainders[k].weight * off * off;
  }
  return best;
}

}  // namespace

bool are_usable(std::span<const Remainder> remainders) {
  return remainders.size() >= 2 &&
         std::all_of(remainders.begin(), remainders.end(), [](const Remainder& r) {
           return std::isfinite(r.value_ns) && std::isfinite(r.modulus_ns) && r.modulus_ns > 0 &&
                  std::isfinite(r.weight) && r.weight > 0;
         });
}

CrtSolution crt_mixed_integer(std::span<const Remainder> remainders, double limit_ns) {
  constexpr double most_breakpoints = 1e8;
  if (!are_usable(remainders) || !(limit_ns > 0)) return {};
  std::vector<double> turns;
  double breakpoints = 0;
  for (const Remainder& r : remainders) {
    turns.push_back(std::round(-r.value_ns / r.modulus_ns));
    breakpoints += limit_ns / r.modulus_ns;
  }
  if (!(breakpoints < most_breakpoints)) return {};

  const auto next_ns = [&](std::size_t k) {
    return remainders[k].value_ns + (turns[k] + 0.5) * remainders[k].modulus_ns;
  };
  CrtSolution best;
  double from_ns = 0;
  while (from_ns < limit_ns) {
    std::size_t first = 0;
    for (std::size_t k = 1; k < remainders.size(); ++k) {
      if (next_ns(k) < next_ns(first)) first = k;
    }
    const double to_ns = std::clamp(next_ns(first), from_ns, limit_ns);
    const CrtSolution here = best_between(remainders, turns, from_ns, to_ns);
    if (!best.found || here.cost < best.cost) best = here;
    turns[first] += 1;
    from_ns = to_ns;
  }
  return best;
}

}  // namespace splid::paper
