#include "bench/studies/crt_wang.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace splid::studies {
namespace {

using paper::CrtSolution;
using paper::Remainder;

double remainder_above_zero(double value, double modulus) {
  const double rest = value - modulus * std::floor(value / modulus);
  return rest < modulus ? rest : 0.0;
}

// The moduli as M Gamma_k in whole units; absent where the Gamma_k are not pairwise coprime.
struct WholeModuli {
  std::int64_t common = 0;           // M
  std::vector<std::int64_t> ratios;  // Gamma_k
};

WholeModuli whole_moduli(std::span<const Remainder> remainders, double unit_ns) {
  WholeModuli whole;
  double multiple = 1;
  for (const Remainder& r : remainders) {
    const double units = std::round(r.modulus_ns / unit_ns);
    multiple *= std::max(units, 1.0);
    if (units < 1 || units > 0x1p53) return {};
    whole.ratios.push_back(static_cast<std::int64_t>(units));
    whole.common = std::gcd(whole.common, whole.ratios.back());
  }
  for (std::int64_t& ratio : whole.ratios) {
    ratio /= whole.common;
    multiple /= static_cast<double>(whole.common);
  }
  if (multiple * static_cast<double>(whole.common) > 0x1p53) return {};
  for (std::size_t i = 0; i < whole.ratios.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (std::gcd(whole.ratios[i], whole.ratios[k]) != 1) return {};
    }
  }
  return whole;
}

// The x in [0, common_ns) that is nearest to all remainders on the circle of common_ns. The
// weighted mean on a circle is an ordinary mean after some of the smallest values have been moved
// up by a turn, which makes K candidates.
double common_remainder_ns(std::span<const Remainder> remainders, double common_ns) {
  struct Rest {
    double value_ns, weight;
  };
  std::vector<Rest> rests;
  double weights = 0;
  double moment = 0;
  for (const Remainder& r : remainders) {
    rests.push_back({remainder_above_zero(r.value_ns, common_ns), r.weight});
    weights += r.weight;
    moment += r.weight * rests.back().value_ns;
  }
  std::sort(rests.begin(), rests.end(),
            [](const Rest& a, const Rest& b) { return a.value_ns < b.value_ns; });
  double best_ns = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const Rest& moved : rests) {
    moment += moved.weight * common_ns;
    const double candidate_ns = remainder_above_zero(moment / weights, common_ns);
    double cost = 0;
    for (const Rest& rest : rests) {
      const double off = std::remainder(rest.value_ns - candidate_ns, common_ns);
      cost += rest.weight * off * off;
    }
    if (cost < least) {
      least = cost;
      best_ns = candidate_ns;
    }
  }
  return best_ns;
}

std::int64_t modulo(std::int64_t value, std::int64_t modulus) {
  const std::int64_t rest = value % modulus;
  return rest < 0 ? rest + modulus : rest;
}

}  // namespace

CrtSolution crt_wang(std::span<const Remainder> remainders, double unit_ns) {
  if (!paper::are_usable(remainders) || !(unit_ns > 0)) return {};
  const WholeModuli whole = whole_moduli(remainders, unit_ns);
  if (whole.ratios.empty()) return {};
  const double common_ns = static_cast<double>(whole.common) * unit_ns;
  const double rest_ns = common_remainder_ns(remainders, common_ns);

  // Remainder k less the common remainder is q_k M. The number that is sought is q_k modulo
  // Gamma_k, for every k: less than Gamma_k steps of the product of the others lead there.
  std::int64_t quotient = 0;
  std::int64_t product = 1;
  for (std::size_t k = 0; k < remainders.size(); ++k) {
    const std::int64_t ratio = whole.ratios[k];
    const std::int64_t q = std::llround((remainders[k].value_ns - rest_ns) / common_ns);
    while (modulo(q - quotient, ratio) != 0) quotient += product;
    product *= ratio;
  }
  CrtSolution solution;
  solution.found = true;
  solution.value_ns = static_cast<double>(quotient) * common_ns + rest_ns;
  for (std::size_t k = 0; k < remainders.size(); ++k) {
    const double modulus_ns = static_cast<double>(whole.ratios[k]) * common_ns;
    const double off = std::remainder(solution.value_ns - remainders[k].value_ns, modulus_ns);
    solution.cost += remainders[k].weight * off * off;
  }
  return solution;
}

}  // namespace splid::studies
