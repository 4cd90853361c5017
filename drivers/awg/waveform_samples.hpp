#pragma once

#include <cstdint>
#include <string>

#include "drivers/awg/awg_model.hpp"
#include "drivers/awg/waveform_plan.hpp"

namespace splid::awg {

// The bytes of one sample, its marker included, which are as many in every format.
inline constexpr std::int64_t sample_bytes = 2;

// The samples [first, first + count) of a plan's memory, as the model takes them. A pulse is a full
// swing up (pulse_is_up) or down and rest is the other end, so that the amplitude and the offset
// alone set the levels. A pulse that runs beyond the end goes on at the beginning, as the generator
// loops.
//
// Threads: any. Errors: none.
std::string waveform_samples(const WaveformPlan& plan, const Model& model, bool pulse_is_up,
                             std::int64_t first, std::int64_t count);

}  // namespace splid::awg
