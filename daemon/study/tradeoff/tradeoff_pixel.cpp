#include "daemon/study/tradeoff/tradeoff_pixel.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "daemon/stream/stream.hpp"
#include "estimator/array/neighbours.hpp"
#include "protocol/error.hpp"

namespace splid::tradeoff {
namespace {

std::size_t index_of(const Config& config, const std::string& name) {
  if (name.empty()) return 0;
  const auto& pixels = config.pixels;
  const auto found = std::find_if(pixels.begin(), pixels.end(),
                                  [&](const PixelOptions& pixel) { return pixel.name == name; });
  if (found != pixels.end()) return static_cast<std::size_t>(found - pixels.begin());
  const std::string names = pixels.empty() ? "there are none; leave it out"
                                           : "give a name such as " + pixels.front().name;
  throw Error(Fault::usage,
              "--pixel " + name + ": is not a name in /pixels of " + config.file + "; " + names);
}

// The pixel itself, and with scene.pool those around it.
std::vector<std::size_t> counted_with(const Config& config, std::size_t pixel) {
  if (!config.scene.pool) return {pixel};
  std::vector<array::PixelDirection> directions;
  for (const PixelOptions& each : config.pixels) {
    directions.push_back({each.azimuth_deg.value(), each.elevation_deg.value()});
  }
  const array::Neighbours neighbours(directions, 1);
  const auto around = neighbours.around(pixel, 1);
  return {around.begin(), around.end()};
}

}  // namespace

Config config_of_pixel(Config config, const std::string& name) {
  const std::size_t pixel = index_of(config, name);
  if (config.pixels.size() < 2) return config;
  check_stream(stream_options(config));
  const StreamOptions own = options_of_pixel(stream_options(config), config.pixels[pixel]);
  config.pulse = own.pulse;
  config.detector = own.detector;
  config.channels.pixels.clear();
  config.channels.photon.clear();
  config.channels.delays_ps.clear();
  for (const std::size_t k : counted_with(config, pixel)) {
    config.channels.photon.push_back(std::to_string(config.pixels[k].input));
    config.channels.delays_ps.push_back(config.pixels[k].delay_ps);
  }
  config.scene.rigid = false;
  config.scene.pool = false;
  config.pixels.clear();
  return config;
}

std::optional<SceneTruth> truth_of_pixel(SceneTruth truth, const ChannelOptions& channels) {
  if (truth.pixels.empty()) return truth;
  std::vector<SceneTruth::Pixel> seen;
  for (const std::string& input : channels.photon) {
    const auto found = std::find_if(
        truth.pixels.begin(), truth.pixels.end(),
        [&](const SceneTruth::Pixel& pixel) { return std::to_string(pixel.input) == input; });
    if (found == truth.pixels.end()) return std::nullopt;
    seen.push_back(std::move(*found));
  }
  truth.pixels.clear();
  truth.distance_m = std::move(seen.front().distance_m);
  truth.velocity_mps = std::move(seen.front().velocity_mps);
  truth.signal_per_pulse = 0;
  truth.background_per_s = 0;
  for (const SceneTruth::Pixel& pixel : seen) {
    truth.signal_per_pulse += pixel.signal_per_pulse;
    truth.background_per_s += pixel.background_per_s;
  }
  return truth;
}

}  // namespace splid::tradeoff
