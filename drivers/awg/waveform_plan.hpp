#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/awg/awg_model.hpp"
#include "drivers/awg/awg_options.hpp"
#include "protocol/pattern.hpp"

namespace splid::awg {

// A pattern as samples: their rate, their number, and where the pulses begin.
struct WaveformPlan {
  double rate_hz = 0;                   // at this rate samples_per_period last exactly one period
  std::int64_t samples_per_period = 0;  // samples in one period of the pattern
  std::int64_t periods = 0;             // equal periods in memory, together whole granules
  std::vector<std::int64_t> pulse_starts;  // first sample of each pulse in a period, ascending
  std::int64_t pulse_samples = 0;          // width of a pulse
  std::int64_t marker_samples = 0;         // width of the marker that begins each period
  double max_deviation_ps = 0;  // largest distance of a pulse from its time in the pattern

  [[nodiscard]] std::int64_t samples() const { return samples_per_period * periods; }
};

// Finds the rate at which the period is a whole number of samples, the waveform whole granules, and
// the pulses as near to their times as can be. Of equally good plans it takes the plan with the
// fewest samples in memory, then the plan with the highest rate. The period is always played
// exactly: a waveform filled up to a granule would change it. Each pulse is within half a sample of
// its time, and no two are played nearer to each other than options.min_spacing_ns.
//
// Errors: Error(Fault::data) saying what cannot be played, and the nearest thing that can: the
// longest period, the largest repeats, or the two pulses that are too close.
WaveformPlan plan_waveform(const Pattern& pattern, const Model& model, const Options& options);

// "241920 samples at 64 GSa/s, 241920 a period; pulses 2 ns wide, at most 0 ps from their times".
std::string in_words(const WaveformPlan& plan);

// The pattern as the generator plays it at the rate rate_hz: each pulse is where its samples begin,
// relative to the marker's first sample, and all times are as long as the samples make them. In a
// pattern of several segments (MRR), pulses may be rounded differently in each repeat of a segment.
// Such pulses keep the times that the pattern gives, which are within the plan's max_deviation_ps
// of the times that are played. A calibrated period was measured after an earlier start and is left
// out.
Pattern played_pattern(const Pattern& pattern, const WaveformPlan& plan, double rate_hz);

}  // namespace splid::awg
