#include "drivers/simulator/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>

#include "drivers/pace.hpp"
#include "drivers/simulator/array_scene.hpp"
#include "drivers/simulator/scene.hpp"
#include "drivers/simulator/scene_truth.hpp"
#include "drivers/simulator/simulated_encoder.hpp"
#include "drivers/tag_writer.hpp"

namespace splid::simulator {
namespace {

// Design note: 1 ms a slice keeps a live stream's latency and the number of waiting tags small; a
// slice costs some 100 ns beside its tags.
constexpr std::int64_t slice_ps = 1'000'000'000;
constexpr std::int64_t heartbeat_ps = 5 * slice_ps;

// Design note: 2026-01-01 00:00 UTC. A scene that runs as fast as possible has no time of day of
// its own, and one seed must give one recording, byte for byte. So the date never changes. Readers
// would take the year 1970 for a broken clock.
constexpr double scene_begins_unix_s = 1'767'225'600;

// The stream's end, in ps since its start. A stream that lasts for ever ends before the tagger's
// clock would overflow, after some 50 days or more.
std::int64_t end_ps_of(const Options& options) {
  if (options.seconds > 0) {
    return static_cast<std::int64_t>(std::llround(options.seconds * ps_per_s));
  }
  constexpr std::int64_t spare_ps = 1'000'000'000'000'000;
  const std::int64_t last_ps = std::numeric_limits<std::int64_t>::max() - spare_ps;
  return last_ps - std::max<std::int64_t>(0, options.start_ps);
}

const bool simulator_registered = register_source("simulator", std::make_unique<Options>);

}  // namespace

std::unique_ptr<TagSource> Options::open(const SourceContext& context) const {
  return std::make_unique<Source>(*this, *context.pattern);
}

std::unique_ptr<EncoderSource> Options::own_encoder(const EncoderOptions& encoder) const {
  if (encoder_rate_hz <= 0) return nullptr;
  return std::make_unique<Encoder>(*this, encoder);
}

Source::Source(Options options, Pattern pattern)
    : options_(std::move(options)), pattern_(std::move(pattern)) {}

SourceInfo Source::info() const {
  SourceInfo info{"simulator", options_.pace == Speed::live, std::nullopt};
  if (!info.live) {
    const double start_s = static_cast<double>(options_.start_ps) / ps_per_s;
    info.start_unix_s = scene_begins_unix_s - start_s;
  }
  if (const auto scanner = options_.scanner_in_use()) info.scan = scanner->lines();
  return info;
}

void Source::run(TagSink& sink, std::stop_token stop) {
  if (!options_.truth.empty()) write_truth_file(options_);
  if (options_.array.used() && !options_.scanner.used()) {
    ArrayScene scene(pattern_, options_);
    play(scene, sink, stop);
  } else {
    Scene scene(pattern_, options_);
    play(scene, sink, stop);
  }
}

// AnyScene: Scene or ArrayScene.
template <class AnyScene>
void Source::play(AnyScene& scene, TagSink& sink, const std::stop_token& stop) const {
  TagWriter writer(sink);
  Pace pace(options_.pace == Speed::live ? 1 : 0);
  const std::int64_t end_ps = end_ps_of(options_);
  for (std::int64_t from_ps = 0; from_ps < end_ps; from_ps += slice_ps) {
    const std::int64_t until_ps = std::min(from_ps + slice_ps, end_ps);
    if (!pace.wait_until(until_ps, stop)) return;
    if (!scene.write_until(until_ps, writer)) return;
    const bool beat = until_ps % heartbeat_ps == 0 || until_ps == end_ps;
    if (beat && !writer.put(heartbeat_tag(options_.start_ps + until_ps))) return;
    writer.publish();
  }
}

}  // namespace splid::simulator
