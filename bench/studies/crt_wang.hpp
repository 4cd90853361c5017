#pragma once

#include <span>

#include "estimator/paper/crt.hpp"

namespace splid::studies {

// The robust Chinese remainder theorem of Wang, Li, Wang and Xia, "Maximum likelihood estimation
// based robust Chinese remainder theorem for real numbers and its fast algorithm", IEEE Trans.
// Signal Process. 63 (2015), for moduli M Gamma_k with pairwise coprime integers Gamma_k. It is
// right as long as remainders err by less than M / 4. Moduli are rounded to multiples of unit_ns
// first, which every turn adds to the error: with 99.9 and 104.1 ns it fails from ten turns (1000
// ns) on, as [P] Fig. 5 shows.
//
// Errors: not found for fewer than two remainders, for ratios that are not pairwise coprime, or for
// a least common multiple above 2^53 units.
paper::CrtSolution crt_wang(std::span<const paper::Remainder> remainders, double unit_ns);

}  // namespace splid::studies
