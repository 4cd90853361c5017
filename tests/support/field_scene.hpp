#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "protocol/pixel.hpp"
#include "protocol/tag.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/scene_runs.hpp"
#include "tests/support/scripted_source.hpp"

// An array of pixels: each input sees a target of its own, and all share the syncs.

namespace splid::test {

// Pixel p, from 0, has the input p + 1.
inline std::vector<PixelOptions> pixels_of(std::size_t count) {
  std::vector<PixelOptions> pixels(count);
  for (std::size_t p = 0; p < count; ++p) {
    pixels[p].input = static_cast<std::int64_t>(p) + 1;
    pixels[p].name = std::to_string(p + 1);
  }
  return pixels;
}

inline Config with_pixels(Config config, std::vector<PixelOptions> pixels) {
  config.channels.pixels.clear();
  config.channels.delays_ps.clear();
  for (const PixelOptions& pixel : pixels) {
    config.channels.pixels.push_back(pixel.input);
    config.channels.delays_ps.push_back(pixel.delay_ps);
  }
  config.pixels = std::move(pixels);
  return config;
}

// The tags of scenes whose targets are 3 m apart and have velocities of their own, one an input,
// with the syncs of the first.
inline std::vector<Tag> field_tags(std::size_t pixels, double seconds, const Pattern& pattern) {
  std::vector<Tag> tags;
  for (std::size_t p = 0; p < pixels; ++p) {
    simulator::Options scene;
    scene.pace = simulator::Speed::max;
    scene.seconds = seconds;
    scene.seed = static_cast<std::int64_t>(p) + 1;
    scene.target.motion = simulator::MotionKind::linear;
    scene.target.distance_m = 30 + 3 * static_cast<double>(p);
    scene.target.velocity_mps = 0.5 * static_cast<double>(p) - 2;
    for (Tag tag : simulate(scene, pattern)) {
      if (tag.kind == TagKind::photon) {
        tags.push_back(photon_tag(tag.time_ps, static_cast<int>(p) + 1));
      } else if (p == 0) {
        tags.push_back(tag);
      }
    }
  }
  std::stable_sort(tags.begin(), tags.end(),
                   [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  return tags;
}

inline std::unique_ptr<TagSource> script(std::vector<Tag> tags) {
  return std::make_unique<ScriptedSource>(std::move(tags), SourceInfo{"field", false, 0.0, false});
}

}  // namespace splid::test
