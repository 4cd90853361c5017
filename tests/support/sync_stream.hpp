#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace splid::test {

// Makes syncs of a pattern's clock with the faults of real instruments.
struct SyncStream {
  double period_ps = 3'780'000;
  double phase_ps = 1234.5;        // of period 0, from begin_ps
  double jitter_ps = 10;           // gaussian, one standard deviation
  double missing = 0;              // fraction left out
  double doubled = 0;              // fraction followed by another one
  double double_after_ps = 3'000;  //
  double strays = 0;               // at random times, as a fraction of the periods
  double ramp_ppm_per_s = 0;       // of the rate; 0 drift at mid-frame
  double wander_ps = 0;            // amplitude of a sine of one period in the frame
  std::int64_t begin_ps = 0;
  std::int64_t end_ps = 50'000'000'000;
  std::uint64_t seed = 1;

  // The time from begin_ps of a pattern start that a steady clock has at steady_ps.
  [[nodiscard]] double clock_ps(double steady_ps) const {
    constexpr double two_pi = 6.283185307179586;
    const auto length_ps = static_cast<double>(end_ps - begin_ps);
    const double from_mid_ps = steady_ps - length_ps / 2;
    double x_ps = steady_ps + 0.5e-18 * ramp_ppm_per_s * from_mid_ps * from_mid_ps;
    if (wander_ps > 0) x_ps += wander_ps * std::sin(two_pi * from_mid_ps / length_ps);
    return x_ps;
  }

  [[nodiscard]] std::vector<std::int64_t> make() const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> jitter(0, 1);
    std::uniform_real_distribution<double> chance(0, 1);
    const auto length_ps = static_cast<double>(end_ps - begin_ps);
    std::vector<std::int64_t> syncs;
    const auto add = [&](double x_ps) {
      if (x_ps >= 0 && x_ps < length_ps) syncs.push_back(begin_ps + std::llround(x_ps));
    };
    for (double k = 0; phase_ps + k * period_ps < length_ps; ++k) {
      const double x_ps = clock_ps(phase_ps + k * period_ps) + jitter_ps * jitter(random);
      if (chance(random) >= missing) {
        add(x_ps);
        if (chance(random) < doubled) add(x_ps + double_after_ps);
      }
      if (chance(random) < strays) add(chance(random) * length_ps);
    }
    std::sort(syncs.begin(), syncs.end());
    return syncs;
  }
};

}  // namespace splid::test
