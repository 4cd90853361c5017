#pragma once

#include "drivers/simulator/simulator_options.hpp"
#include "protocol/truth.hpp"

namespace splid::simulator {

// The truth of a scene: a sample each 1 ms, of the whole stream or, of an endless one, of its first
// 600 s. A stream longer than 600 s has 600,000 steps too, of more than 1 ms each.
SceneTruth scene_truth(const SimulatorOptions& options);

// Writes it to options.truth, whole or not at all.
//
// Errors: Error(Fault::device) with the file and the system's reason.
void write_truth_file(const SimulatorOptions& options);

}  // namespace splid::simulator
