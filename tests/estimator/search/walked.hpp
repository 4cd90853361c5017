#pragma once

#include <cstddef>

namespace splid::test {

// How many bins a line of TaylorTree has walked where it comes to a slice. walk: from the first of
// all slices to the last.
inline std::size_t walked(std::size_t walk, std::size_t slices, std::size_t slice) {
  std::size_t bins = 0;
  for (std::size_t half = slices / 2; half > 0; half /= 2) {
    if ((slice & half) != 0) bins += (walk + 1) / 2;
    walk /= 2;
  }
  return bins;
}

}  // namespace splid::test
