#pragma once

#include <optional>
#include <string>

#include "config/config.hpp"
#include "protocol/truth.hpp"

namespace splid::tradeoff {

// Of several pixels a tradeoff measures one, for which it makes a configuration of that pixel
// alone. With scene.pool the pixel's photons are those of the pixels around it too, 3 x 3, as of
// one detector with several inputs.
//
// Threads: any.

// name: of the pixel; empty: the first one. The result has no pixels, but their inputs in
// channels.photon, the chosen pixel's before all others. Errors: Error(Fault::usage) where no pixel
// has that name, and as check_stream().
Config config_of_pixel(Config config, const std::string& name);

// What the pixel sees of the truth of an array, with the rates of all inputs of channels.photon.
// The truth of a scene without an array stays as it is; absent where the array lacks an input.
std::optional<SceneTruth> truth_of_pixel(SceneTruth truth, const ChannelOptions& channels);

}  // namespace splid::tradeoff
