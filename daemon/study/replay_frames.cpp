#include "daemon/study/replay_frames.hpp"

#include <chrono>
#include <exception>
#include <filesystem>
#include <optional>
#include <utility>

#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/stream/encoder_feed.hpp"
#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/stream/scan_check.hpp"
#include "daemon/stream/scene_message.hpp"
#include "daemon/stream/stream.hpp"
#include "daemon/stream/sync_diagnosis.hpp"
#include "drivers/encoder/encoder_source.hpp"
#include "drivers/replay/replay.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::chrono::milliseconds most_asleep{50};

// Whether a file of encoder counts has any counts. Beside a recording that was killed early, or was
// made without an encoder, it may have none.
bool holds_counts(const std::string& file) {
  try {
    return open_encoder_file(file) != nullptr;
  } catch (const Error& error) {
    log_warning("no reference: {}", error.what());
    return false;
  }
}

// Makes the messages of one stream's frames.
class Messages {
 public:
  Messages(const Config& config, bool syncs_are_counted) : context_(frame_context(config)) {
    context_.syncs_are_counted = syncs_are_counted;
    if (config.pixels.size() > 1) {
      scene_.emplace(config);
      scene_->set_syncs_are_counted(syncs_are_counted);
    }
    auto counts = open_encoder(config.encoder, config.source.get());
    if (counts) encoder_.emplace(std::move(counts), config.encoder, host_clock());
  }

  void give(const EstimationUnit& unit, const TakeFrame& take) {
    const auto waited_ns = host_clock().steady_ns() - unit.frame.arrival_ns;
    const double waited_ms = static_cast<double>(waited_ns) / 1e6;
    if (!scene_) {
      give_frame(unit, waited_ms, take);
    } else if (unit.wanted) {
      for (const SceneMessage::Pixel& pixel : scene_->make(unit, waited_ms).pixels) {
        take(pixel.frame);
      }
    }
  }

 private:
  // A frame that is not wanted has a message too, since the reference counts every frame.
  void give_frame(const EstimationUnit& unit, double waited_ms, const TakeFrame& take) {
    const Frame& frame = unit.frame;
    const auto reference = encoder_ ? encoder_->reference(frame) : std::nullopt;
    FrameMessage message = make_frame_message(
        frame, unit.estimate, context_, {unit.mid_unix_s, unit.compute_ms, waited_ms, unit.effort});
    message.reference = reference;
    if (unit.wanted) take(message);
  }

  FrameContext context_;
  std::optional<SceneMaker> scene_;  // of several pixels
  std::optional<EncoderFeed> encoder_;
};

}  // namespace

void read_from(const std::string& recording, const std::string& counts, double speed,
               Config& config) {
  auto source = std::make_unique<ReplayOptions>();
  source->recording = recording;
  source->speed = speed;
  config.source = std::move(source);
  config.source_driver = "replay";
  config.encoder.address.clear();
  const std::string beside = encoder_file_of(recording);
  if (!counts.empty()) {
    config.encoder.file = counts;
  } else if (std::filesystem::exists(beside) && holds_counts(beside)) {
    config.encoder.file = beside;
  }
}

void measure_frames(const Config& config, std::unique_ptr<TagSource> source, const TakeFrame& take,
                    const GoOn& go_on, FrameChoice wanted) {
  Messages messages(config, source->info().syncs_are_counted);
  StreamOptions options = stream_options(config);
  options.wanted = std::move(wanted);
  Stream stream(std::move(options), std::move(source), host_clock());
  LockCounts counts;
  bool to_the_end = true;
  stream.start();
  while (!stream.ended()) {
    if (const EstimationUnit* unit = stream.next()) {
      messages.give(*unit, take);
      ++counts.frames;
      counts.locked_frames += unit->frame.sync.locked ? 1 : 0;
      stream.release();
    } else {
      stream.wait(most_asleep);
    }
    if (to_the_end && !go_on()) {
      to_the_end = false;
      stream.request_stop();
    }
  }
  if (const std::exception_ptr fault = stream.join()) std::rethrow_exception(fault);
  if (!to_the_end) return;
  check_scan(stream.counters().framer);
  counts.syncs = stream.counters().framer.syncs;
  check_locked(counts, stream.diagnosis());
}

}  // namespace splid
