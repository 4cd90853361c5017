#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"

namespace splid::test {

// A recording such as a time tagger makes beside a laser of 80 MHz, for those who do not have the
// recordings of real instruments: four pulses a period that are even but for some tens of ps, with
// a sharp rise and a tail; only the syncs beside photons; a second input that sees the same light
// earlier. The target is at rest.
struct LaserRecording {
  static constexpr double period_ps = 12'512.626;
  static constexpr double sync_jitter_ps = 10;
  static constexpr double second_input_earlier_ps = 2052;
  static constexpr double length_ps = 0.2867e12;
  static constexpr int photons_on_input_1 = 43'736;
  static constexpr int photons_on_input_2 = 62'437;

  static std::vector<Tag> tags() {
    constexpr std::array<double, 4> pulses_ps = {0, 3'150, 6'210, 9'420};
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> when(0, length_ps / period_ps - 2);
    std::uniform_int_distribution<std::size_t> which(0, pulses_ps.size() - 1);
    std::normal_distribution<double> rise(0, 40);
    std::exponential_distribution<double> tail(1.0 / 150);
    std::set<std::int64_t> periods;
    std::vector<Tag> tags;
    for (int i = 0; i < photons_on_input_1 + photons_on_input_2; ++i) {
      const bool is_first = i < photons_on_input_1;
      const auto period = static_cast<std::int64_t>(when(random)) + 1;
      const double at_ps = static_cast<double>(period) * period_ps + pulses_ps.at(which(random)) +
                           rise(random) + tail(random) - (is_first ? 0 : second_input_earlier_ps);
      tags.push_back(photon_tag(std::llround(at_ps), is_first ? 1 : 2));
      periods.insert(period);
    }
    std::normal_distribution<double> jitter(0, sync_jitter_ps);
    for (const std::int64_t period : periods) {
      tags.push_back(
          sync_tag(std::llround(static_cast<double>(period) * period_ps + jitter(random))));
    }
    std::ranges::sort(tags, {}, &Tag::time_ps);
    return tags;
  }

  static void write(const std::string& file) {
    const DeviceClock clock{SourceInfo{"made", false, 1.6e9}, host_clock()};
    PtuFacts facts;
    facts.instrument = "made";
    recording::PtuWriter writer(file, facts, clock, true);
    writer.write(tags());
    writer.close();
  }
};

}  // namespace splid::test
