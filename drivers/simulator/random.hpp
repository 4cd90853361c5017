#pragma once

#include <array>
#include <cstdint>

namespace splid::simulator {

// Random numbers that are the same on every machine: xoshiro256++ (Blackman and Vigna, 2019) and
// ziggurats of 256 layers (Marsaglia and Tsang, 2000) whose tables come from portable_log.
//
// Threads: one. No allocation.
class Random {
 public:
  // stream: which of a seed's independent sequences this is. Each part of a scene has its own, so
  // that an option of one part does not change what the other parts draw.
  Random(std::uint64_t seed, std::uint64_t stream);

  std::uint64_t bits();
  double uniform();      // in (0, 1)
  double exponential();  // mean 1, at most largest_exponential
  double normal();       // mean 0, standard deviation 1, at most largest_normal either side

  static constexpr double largest_exponential = 45;
  static constexpr double largest_normal = 14;

 private:
  double exponential_edge(std::uint64_t layer, double x, bool& accepted);
  double normal_edge(std::uint64_t layer, double x, bool& accepted);

  std::array<std::uint64_t, 4> state_{};
};

}  // namespace splid::simulator
