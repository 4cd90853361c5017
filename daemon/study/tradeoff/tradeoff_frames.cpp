#include "daemon/study/tradeoff/tradeoff_frames.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <utility>

#include "config/read_file.hpp"
#include "daemon/base/text.hpp"
#include "daemon/stream/frame_plan.hpp"
#include "daemon/stream/framer.hpp"
#include "daemon/stream/framer_sink.hpp"
#include "daemon/study/tradeoff/tradeoff_pixel.hpp"
#include "drivers/replay/replay.hpp"
#include "drivers/simulator/array_pixels.hpp"
#include "drivers/simulator/scene_truth.hpp"
#include "drivers/simulator/simulator.hpp"
#include "estimator/model/units.hpp"
#include "protocol/error.hpp"

namespace splid::tradeoff {
namespace {

constexpr double ms_per_s = 1e3;
constexpr std::size_t max_photons = (std::size_t{256} << 20) / sizeof(std::int64_t);

// The frames that a run must have room for besides its first frame.
constexpr double least_frames_of_a_run = 3;

std::string truth_file(const std::string& recording) {
  return std::filesystem::path(recording).replace_extension(".truth.json").string();
}

simulator::Options default_scene(const Config& config) {
  simulator::Options scene;
  scene.detection.sigma_ps = config.pulse.sigma_ps;
  return scene;
}

// The target of an array is that of the pixel.
void aim(simulator::Options& scene, const ChannelOptions& channels) {
  if (!scene.array.used()) return;
  for (const simulator::ArrayPixel& pixel : simulator::array_pixels(scene)) {
    if (std::to_string(pixel.scene.photon_input) != channels.photon.front()) continue;
    scene.target = pixel.scene.target;
  }
}

FrameOrigin scene_origin(simulator::Options scene, std::string name, ChannelOptions channels) {
  scene.pace = simulator::Speed::max;
  scene.truth.clear();
  scene.seconds = 1e-3;
  aim(scene, channels);
  auto constants = truth_of_pixel(simulator::scene_truth(scene), channels);
  if (!constants) {
    throw Error(Fault::usage, "/source/array has no input " + channels.photon.front() +
                                  " or none of a pixel around it; see /pixels");
  }
  return {std::move(name), std::move(scene), {}, std::move(constants), std::move(channels)};
}

// How long a run may last: nine tenths of the time until a target that comes closer at a constant
// speed arrives.
double longest_run_s(const simulator::Options& scene) {
  const simulator::TargetOptions& target = scene.target;
  if (target.motion != simulator::MotionKind::linear || target.velocity_mps >= 0) {
    return std::numeric_limits<double>::infinity();
  }
  return 0.9 * target.distance_m / -target.velocity_mps;
}

// The length that a frame gets when length_ms is asked for: a whole number of pattern periods.
double whole_periods_ms(const Pattern& pattern, double length_ms) {
  const double period_ps = pattern_period_ps(pattern);
  return periods_per_frame(length_ms, period_ps) * period_ps / ps_per_ms;
}

std::optional<std::string> length_fault(const Config& config, const FrameOrigin& origin,
                                        double length_ms) {
  const double made_ms = whole_periods_ms(config.pattern, length_ms);
  if (std::abs(made_ms / length_ms - 1) > 0.1) {
    return fmt::format("{:g} ms is no whole number of pattern periods ({:g} ms)", length_ms,
                       pattern_period_ps(config.pattern) / ps_per_ms);
  }
  if (origin.scene) {
    const double run_ms = longest_run_s(*origin.scene) * ms_per_s;
    if (run_ms < (1 + least_frames_of_a_run) * length_ms) {
      return fmt::format("the target arrives within {:.3g} ms", run_ms / 0.9);
    }
  }
  try {
    check_frame_fits(length_ms, config.pattern,
                     static_cast<std::size_t>(config.pipeline.ring_capacity_tags));
  } catch (const Error& error) {
    return error.what();
  }
  return std::nullopt;
}

// Copies frames out of the framer until it has enough.
class Collector final : public FrameSink {
 public:
  Collector(const Config& config, double length_ms, std::size_t count,
            const CollectProgress& progress, std::stop_source& enough)
      : frame_(frame_capacity(length_ms, config.pattern,
                              static_cast<std::size_t>(config.pipeline.ring_capacity_tags), false)),
        min_seen_fraction_(config.frame.min_seen_fraction),
        count_(count),
        progress_(progress),
        enough_(enough) {}

  // truth: of the run, which it outlives; null: not known.
  void start_run(const SceneTruth* truth) {
    truth_ = truth;
    first_ = true;
  }
  [[nodiscard]] bool full() const { return judged_ >= count_ || photons_ >= max_photons; }
  [[nodiscard]] std::uint64_t unlocked() const { return unlocked_; }
  std::vector<KeptFrame>& kept() { return kept_; }

  Frame& open() override { return frame_; }
  void close() override {
    if (full()) return;
    if (!frame_.sync.locked) ++unlocked_;
    if (!frame_.sync.locked || frame_.seen_fraction < min_seen_fraction_) return;
    KeptFrame kept{frame_.start_ps,
                   frame_.end_ps,
                   {frame_.photons_ps.begin(), frame_.photons_ps.end()},
                   {frame_.losses.begin(), frame_.losses.end()},
                   frame_.sync,
                   {frame_.before_ps.begin(), frame_.before_ps.end()},
                   {frame_.photons_of_input.begin(), frame_.photons_of_input.end()},
                   frame_.seen_fraction,
                   first_,
                   std::nullopt};
    if (truth_ != nullptr) kept.truth = state_at(*truth_, kept.middle_ps());
    if (truth_ != nullptr && !kept.truth) return;
    keep(std::move(kept));
  }

 private:
  // Design note: electronics between sync and detector delay each photon by a time d, and so show
  // the target as it was d / 2 earlier. At 140 m/s and [P]'s 1855 ns that is 0.13 mm, a fifth of
  // the bound.
  static std::optional<TargetState> state_at(const SceneTruth& truth, std::int64_t time_ps) {
    const double half_ps = truth.electronic_delay_ns / ns_per_ps / 2;
    const auto state = truth.at(time_ps - std::llround(half_ps));
    if (!state || !(state->distance_m > 0)) return std::nullopt;
    return TargetState{2e9 * state->distance_m / speed_of_light_mps + truth.electronic_delay_ns,
                       state->velocity_mps};
  }

  void keep(KeptFrame kept) {
    photons_ += kept.photons_ps.size();
    judged_ += kept.first ? 0 : 1;
    first_ = false;
    kept_.push_back(std::move(kept));
    progress_(judged_);
    if (full()) enough_.request_stop();
  }

  Frame frame_;
  double min_seen_fraction_;
  std::size_t count_;
  const CollectProgress& progress_;
  std::stop_source& enough_;
  const SceneTruth* truth_ = nullptr;
  bool first_ = true;
  std::size_t judged_ = 0;
  std::size_t photons_ = 0;
  std::uint64_t unlocked_ = 0;
  std::vector<KeptFrame> kept_;
};

// Plays a source once into the collector.
void play(const Config& config, const FrameOrigin& origin, double length_ms, TagSource& source,
          Collector& collector, const std::stop_token& stop) {
  const ChannelMap channels(origin.channels);
  Framer framer(
      framer_options(length_ms, config.pattern, config.drift.method, config.detector.walk),
      channels, collector);
  FramerSink sink(framer, stop);
  source.run(sink, stop);
  framer.finish();
  const bool locked = !collector.kept().empty() || collector.unlocked() == 0;
  if (locked || origin.scene || stop.stop_requested()) return;
  const std::string reason =
      framer.diagnosis()
          ? in_words(*framer.diagnosis())
          : grouped(framer.totals().photons) + " photons and " + grouped(framer.totals().syncs) +
                " syncs, but no frame with syncs that agree; see channels.sync and pattern.file";
  throw Error(Fault::data, origin.recording + ": " + reason);
}

std::unique_ptr<TagSource> open_recording(const Config& config, const std::string& file) {
  auto replay = std::make_unique<ReplayOptions>();
  replay->recording = file;
  SourceContext context;
  context.pattern = &config.pattern;
  context.warn = [](const std::string&) {};
  return replay->open(context);
}

}  // namespace

FrameOrigin find_origin(const Config& config, const std::string& recording) {
  if (recording.empty()) {
    if (const auto* scene = dynamic_cast<const simulator::Options*>(config.source.get())) {
      return scene_origin(*scene, "the configured scene", config.channels);
    }
    if (const auto* replay = dynamic_cast<const ReplayOptions*>(config.source.get())) {
      return find_origin(config, replay->recording);
    }
    return scene_origin(default_scene(config), "the simulator's default scene", {});
  }
  FrameOrigin origin{recording, std::nullopt, recording, std::nullopt, config.channels};
  const std::string truth = truth_file(recording);
  if (!std::filesystem::exists(truth)) return origin;
  try {
    origin.truth = truth_of_pixel(truth_from_json(read_file(truth)), config.channels);
  } catch (const Error& error) {
    throw Error(Fault::data, truth + ": " + error.what());
  }
  return origin;
}

std::vector<double> possible_lengths_ms(const Config& config, const FrameOrigin& origin,
                                        std::vector<double> asked_ms, const Warn& warn) {
  const double length_ms = config.frame.length_ms;
  if (asked_ms.empty()) {
    asked_ms = {length_ms / 10, length_ms * 2 / 5, length_ms, length_ms * 4};
  }
  std::sort(asked_ms.begin(), asked_ms.end());
  asked_ms.erase(std::unique(asked_ms.begin(), asked_ms.end()), asked_ms.end());
  std::vector<double> possible_ms;
  std::string reason;
  for (const double asked : asked_ms) {
    const auto fault = length_fault(config, origin, asked);
    if (!fault) {
      possible_ms.push_back(asked);
      continue;
    }
    reason = *fault;
    warn(fmt::format("frames of {:g} ms are left out: ", asked) + reason);
  }
  if (possible_ms.empty()) throw Error(Fault::usage, "no frame length can be measured: " + reason);
  return possible_ms;
}

std::vector<KeptFrame> collect_frames(const Config& config, const FrameOrigin& origin,
                                      double length_ms, std::size_t count,
                                      const CollectProgress& progress,
                                      const std::stop_token& stop) {
  std::stop_source enough;
  const std::stop_callback pass_on(stop, [&enough] { enough.request_stop(); });
  Collector collector(config, length_ms, count, progress, enough);
  if (!origin.scene) {
    collector.start_run(origin.truth ? &*origin.truth : nullptr);
    const auto source = open_recording(config, origin.recording);
    play(config, origin, length_ms, *source, collector, enough.get_token());
    return std::move(collector.kept());
  }
  // Two frames more: the first frame, and the parts of frames that the start and the end cut off.
  simulator::Options scene = *origin.scene;
  scene.seconds = std::min(longest_run_s(scene),
                           (static_cast<double>(count) + 2) * length_ms / ms_per_s + 0.01);
  for (; !enough.stop_requested(); ++scene.seed) {
    const auto truth = truth_of_pixel(simulator::scene_truth(scene), origin.channels);
    collector.start_run(truth ? &*truth : nullptr);
    simulator::Source source(scene, config.pattern);
    const std::size_t before = collector.kept().size();
    play(config, origin, length_ms, source, collector, enough.get_token());
    if (collector.kept().size() == before) break;
  }
  return std::move(collector.kept());
}

}  // namespace splid::tradeoff
