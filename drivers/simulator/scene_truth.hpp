#pragma once

#include "drivers/simulator/simulator_options.hpp"
#include "protocol/truth.hpp"

namespace splid::simulator {

// The truth of a scene, with a sample each 1 ms, for the whole stream; for an endless stream, for
// its first 600 s. A stream that is longer than 600 s has 600,000 steps of more than 1 ms. Of a
// scan, each pixel has a sample in the middle of each of its dwells; where these are more than
// 600,000, of some pictures only.
SceneTruth scene_truth(const Options& options);

// Writes a scene's truth to options.truth, as a whole file or not at all.
//
// Errors: Error(Fault::device) with the file and the system's reason.
void write_truth_file(const Options& options);

}  // namespace splid::simulator
