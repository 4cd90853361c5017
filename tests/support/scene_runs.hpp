#pragma once

#include <algorithm>
#include <vector>

#include "drivers/simulator/simulator_options.hpp"
#include "drivers/source.hpp"
#include "protocol/pattern.hpp"
#include "tests/support/vector_sink.hpp"

namespace splid::test {

inline Pattern one_segment(double period_ps, std::vector<double> times_ps,
                           std::vector<double> amplitudes) {
  Pattern pattern;
  pattern.unambiguous_delay_ps = period_ps;
  pattern.segments.push_back({period_ps, std::move(times_ps), std::move(amplitudes), 0});
  return pattern;
}

// [P]'s: 180 and 189 ns interleaved, 40 pulses in 3780 ns.
inline Pattern paper_pattern() {
  std::vector<double> times_ps;
  for (int i = 0; i < 21; ++i) times_ps.push_back(180'000.0 * i);
  for (int i = 1; i < 20; ++i) times_ps.push_back(189'000.0 * i);
  std::sort(times_ps.begin(), times_ps.end());
  return one_segment(3'780'000, times_ps, std::vector<double>(times_ps.size(), 1.0));
}

// A scene without any noise, whose photons all come from the target: what is left is physics.
inline simulator::Options noiseless_scene() {
  simulator::Options options;
  options.detection.sigma_ps = 0;
  options.ambient_per_s = 0;
  options.dark_per_s = 0;
  options.sync.jitter_ps = 0;
  options.drift_ppm = 0;
  options.pace = simulator::Speed::max;
  options.seconds = 0.05;
  return options;
}

inline std::vector<Tag> simulate(const simulator::Options& options, const Pattern& pattern) {
  SourceContext context;
  context.pattern = &pattern;
  VectorSink sink;
  options.open(context)->run(sink, {});
  return sink.tags;
}

inline std::vector<std::int64_t> times_ps(const std::vector<Tag>& tags, TagKind kind) {
  std::vector<std::int64_t> times;
  for (const Tag& tag : tags) {
    if (tag.kind == kind) times.push_back(tag.time_ps);
  }
  return times;
}

}  // namespace splid::test
