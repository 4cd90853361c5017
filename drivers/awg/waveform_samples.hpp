#pragma once

#include <cstdint>
#include <string>

#include "drivers/awg/awg_model.hpp"
#include "drivers/awg/waveform_plan.hpp"

namespace splid {

// Bytes of one sample, its marker included, in every format.
inline constexpr std::int64_t sample_bytes = 2;

// Samples `first` to before `first + count` of a plan's memory as the model takes them: a full
// swing up (pulse_is_up) or down for a pulse and the other end for rest, so that the levels are
// amplitude and offset alone. What runs beyond the end goes on at the beginning, as the generator
// loops.
//
// Threads: any. Errors: none.
std::string waveform_samples(const WaveformPlan& plan, const AwgModel& model, bool pulse_is_up,
                             std::int64_t first, std::int64_t count);

}  // namespace splid
