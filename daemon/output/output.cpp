#include "daemon/output/output.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/base/log.hpp"
#include "daemon/stream/open_source.hpp"

namespace splid {
namespace {

// How long the thread that publishes sleeps at most before it looks around.
constexpr std::chrono::milliseconds idle{50};

// Frames that are lost beyond the range come as other frames do; between two their reason holds.
constexpr std::int64_t beyond_holds_ns = 1'000'000'000;

std::string walk_text(const std::vector<NumberPair>& walk) {
  std::string rows;
  for (const auto& [wait_ns, delay_ps] : walk) {
    rows += fmt::format("{}[{:g}, {:g}]", rows.empty() ? "" : ", ", wait_ns, delay_ps);
  }
  return "detector.walk: [" + rows + "]";
}

checks::DetectorWatch watch_of(const OutputOptions& options) {
  return {options.fold.pattern, options.fold.pulse, options.detector, options.fold.reference,
          options.inputs};
}

}  // namespace

OutputOptions output_options(const Config& config) {
  return {frame_context(config),
          status_options(config),
          config.encoder,
          config.source.get(),
          fold_options(config),
          config.detector,
          config.channels.photon.size(),
          config.pixels.size() > 1 ? std::optional<SceneMaker>(config) : std::nullopt};
}

Output::Output(OutputOptions options, Ends ends, const Clock& clock)
    : options_(std::move(options)),
      ends_(std::move(ends)),
      clock_(clock),
      reporter_(options_.status, ends_.publisher, clock),
      notifier_(clock),
      context_(options_.context),
      scene_(options_.scene),
      fold_(options_.fold, ends_.publisher, clock),
      detector_(watch_of(options_)),
      liveness_(options_.status.frame_length_ms) {}

Output::~Output() = default;

void Output::begin() {
  auto counts = open_encoder(options_.encoder, options_.source);
  has_encoder_ = counts != nullptr;
  if (!counts) return;
  encoder_.emplace(std::move(counts), options_.encoder, clock_);
  encoder_->observe([this](const EncoderBatch& batch) { give_counts(batch); });
}

StreamSummary Output::publish(Stream& stream) {
  take_reloaded();
  liveness_ = Liveness(options_.status.frame_length_ms);
  sync_fault_.clear();
  if (ends_.device != nullptr) ends_.device->set_wake(&stream.wake());
  context_.syncs_are_counted = stream.info().syncs_are_counted;
  if (scene_) scene_->set_syncs_are_counted(context_.syncs_are_counted);
  pixels_ = {};
  reporter_.begin(stream.info());
  detector_.clear();
  walk_said_ = false;
  stream.start();
  StreamSummary summary;
  while (!stream.ended()) {
    if (const EstimationUnit* unit = stream.next()) {
      publish_unit(*unit, summary);
      stream.release();
      if (observer_done_) stream.request_stop();
    } else {
      stream.wait(idle);
    }
    look_around(stream);
  }
  end(stream, summary);
  if (observer_fault_) {
    stop("");
    std::rethrow_exception(observer_fault_);
  }
  return summary;
}

void Output::publish_unit(const EstimationUnit& unit, StreamSummary& summary) {
  if (scene_) {
    publish_scene(unit, summary);
  } else {
    publish_frame(unit, summary);
  }
}

double Output::latency_ms(const Frame& frame) const {
  return static_cast<double>(clock_.steady_ns() - frame.arrival_ns) / 1e6;
}

void Output::publish_frame(const EstimationUnit& unit, StreamSummary& summary) {
  const Frame& frame = unit.frame;
  const auto reference = encoder_ ? encoder_->reference(frame) : std::nullopt;
  FrameMessage message =
      make_frame_message(frame, unit.estimate, context_,
                         {unit.mid_unix_s, unit.compute_ms, latency_ms(frame), unit.effort});
  message.reference = reference;
  message.sequence = reporter_.status().frames;
  const std::string json = to_json(message);
  ends_.publisher.publish_frame(json);
  detector_.add(frame.view(), unit.estimate);
  FoundList recent = detector_.found();
  if (recent.has(FindingName::timing_walk) && !std::exchange(walk_said_, true)) {
    log_warning("the detector walks; as the last second shows it: {}", walk_text(detector_.walk()));
  }
  for (const Finding& finding : unit.estimate.recent_findings.all()) recent.add(finding);
  count(message, unit, recent, summary);
  give_frame(message);
  tell_observer(message, json);
  fold_.frame_published(frame, unit.estimate, message);
}

void Output::publish_scene(const EstimationUnit& unit, StreamSummary& summary) {
  SceneMessage& scene = scene_->make(unit, latency_ms(unit.frame));
  scene.whole.sequence = reporter_.status().frames;
  const std::string json = to_json(scene);
  ends_.publisher.publish_scene(json);
  publish_pixels(unit, scene);
  pixels_.add(scene);
  reporter_.pixels_seen(pixels_.seen());
  count(scene.whole, unit, {}, summary);
  tell_observer(scene.whole, json);
}

// The frames of those pixels that somebody asks for, and the pictures of the surest.
void Output::publish_pixels(const EstimationUnit& unit, const SceneMessage& scene) {
  const std::vector<bool>& asked_for = pixels_asked_for(scene);
  std::size_t surest = 0;
  for (std::size_t i = 0; i < scene.pixels.size(); ++i) {
    const SceneMessage::Pixel& pixel = scene.pixels[i];
    if (asked_for[i]) ends_.publisher.publish_pixel(pixel.name, to_json(pixel.frame));
    give_frame(pixel.frame);
    tell_observer(pixel);
    if (pixel.frame.significance.value_or(0) >
        scene.pixels[surest].frame.significance.value_or(0)) {
      surest = i;
    }
  }
  const SceneMessage::Pixel& pixel = scene.pixels[surest];
  fold_.frame_published(*unit.frame.pixels[surest], unit.pixels[surest].estimate, pixel.frame,
                        pixel.name);
}

const std::vector<bool>& Output::pixels_asked_for(const SceneMessage& scene) {
  const auto topics = ends_.publisher.pixel_topics(pixel_topics_known_);
  if (!topics && pixels_asked_for_.size() == scene.pixels.size()) return pixels_asked_for_;
  pixels_asked_for_.assign(scene.pixels.size(), false);
  if (!topics) return pixels_asked_for_;
  for (std::size_t i = 0; i < scene.pixels.size(); ++i) {
    const std::string topic = pixel_topic(scene.pixels[i].name);
    pixels_asked_for_[i] = std::any_of(topics->begin(), topics->end(),
                                       [&](const auto& asked) { return topic.starts_with(asked); });
  }
  return pixels_asked_for_;
}

// What every frame that was published counts for.
void Output::count(const FrameMessage& message, const EstimationUnit& unit, const FoundList& recent,
                   StreamSummary& summary) {
  summary.add(message, message.compute_ms.value_or(0), unit.frame.sync.locked);
  summary.lost_tags += unit.frame.lost_tags;
  reporter_.frame_published(message, to_message(recent), unit.frame.is_cut_off);
  summary.ring_needed = std::max(summary.ring_needed, reporter_.ring_needed());
  if (ends_.metrics == nullptr) return;
  ends_.metrics->frame_published(message, reporter_.effort_is_lowered());
}

// An observer that fails ends the stream like an observer that has enough; what is on its way is
// still published, so that no stage waits for another that is gone.
void Output::tell_observer(const FrameMessage& message, const std::string& json) {
  if (!ends_.observer || observer_done_) return;
  try {
    observer_done_ = !ends_.observer(message, json);
  } catch (...) {
    observer_fault_ = std::current_exception();
    observer_done_ = true;
  }
}

void Output::tell_observer(const SceneMessage::Pixel& pixel) {
  if (!ends_.pixel_observer || observer_done_) return;
  try {
    ends_.pixel_observer(pixel);
  } catch (...) {
    observer_fault_ = std::current_exception();
    observer_done_ = true;
  }
}

void Output::look_around(Stream& stream) {
  if (sync_fault_.empty() && stream.diagnosis() != nullptr) {
    sync_fault_ = in_words(*stream.diagnosis());
    log_warning(sync_fault_);
  }
  take_reloaded();
  const StreamHealth now = health(stream);
  reporter_.tick(now);
  const WorkSeen seen{reporter_.status().frames, stream.ring_touches(), stream.ring_is_empty(),
                      stream.info().live};
  notifier_.tick(reporter_.status(), liveness_.is_alive(seen, clock_.steady_ns()));
  if (ends_.metrics == nullptr) return;
  ends_.metrics->ring_filled(now.ring_fill_ratio);
  if (ends_.metrics->due()) ends_.metrics->refresh(reporter_.status(), all_counters(stream));
}

StreamHealth Output::health(Stream& stream) {
  StreamHealth health;
  // Before last_arrival_ns: the framer empties the ring after it has set that.
  health.ring_is_empty = stream.ring_is_empty();
  const FramerTotals tags = all_counters(stream).framer;
  health.tags = tags.events;
  const std::int64_t now_ns = clock_.steady_ns();
  if (std::exchange(beyond_, tags.beyond) != tags.beyond)
    beyond_until_ns_ = now_ns + beyond_holds_ns;
  health.clock_is_at_its_end = now_ns < beyond_until_ns_;
  health.last_arrival_ns = stream.last_arrival_ns();
  health.ring_fill_ratio = stream.take_highest_fill();
  health.sync_fault = sync_fault_;
  if (ends_.device != nullptr) {
    health.device_reports = ends_.device->take_reports();
    health.notices = ends_.device->take_notices();
    health.configuration_fault = ends_.device->configuration_fault();
  }
  health.scan_fault = scan_watch_.look(stream.counters().framer, now_ns);
  if (!std::exchange(scan_is_faulty_, !health.scan_fault.empty()) && scan_is_faulty_) {
    log_warning(health.scan_fault);
  }
  // After the notices, so that no notice tells of a fault that is not here.
  const std::scoped_lock lock(recording_mutex_);
  if (recording_ != nullptr) {
    health.recording_fault = recording_->fault();
    health.recording = recording_->status();
  }
  return health;
}

StreamCounters Output::all_counters(const Stream& stream) const {
  StreamCounters all = before_;
  return all += stream.counters();
}

void Output::end(Stream& stream, StreamSummary& summary) {
  summary.fault = stream.join();
  const StreamCounters counters = stream.counters();
  summary.tags = counters.framer;
  summary.discarded_tags = counters.discarded_tags;
  if (stream.diagnosis() != nullptr) summary.diagnosis = *stream.diagnosis();
  before_ += counters;
  last_fill_ = stream.take_highest_fill();
  scan_watch_ = {};
  scan_is_faulty_ = false;
  has_encoder_ = false;
  encoder_.reset();
  if (ends_.device != nullptr) ends_.device->set_wake(nullptr);
}

void Output::wait(const std::string& reason) {
  StreamHealth health;
  health.tags = before_.framer.events;
  if (ends_.device != nullptr) {
    health.notices = ends_.device->take_notices();
    health.configuration_fault = ends_.device->configuration_fault();
  }
  reporter_.wait(health, reason);
  notifier_.tick(reporter_.status(), true);
  if (ends_.metrics != nullptr && ends_.metrics->due()) {
    ends_.metrics->refresh(reporter_.status(), before_);
  }
}

void Output::stop(const std::string& reason) {
  StreamHealth health;
  health.tags = before_.framer.events;
  health.ring_fill_ratio = last_fill_;
  {
    const std::scoped_lock lock(recording_mutex_);
    if (recording_ != nullptr) health.recording = recording_->status();
  }
  reporter_.stop(health, reason);
  notifier_.tick(reporter_.status(), true);
  if (ends_.metrics != nullptr) ends_.metrics->refresh(reporter_.status(), before_);
}

void Output::record(recording::Tap* recording) {
  if (recording != nullptr && has_encoder_) recording->expect_counts();
  const std::scoped_lock lock(recording_mutex_);
  recording_ = recording;
}

void Output::give_counts(const EncoderBatch& batch) {
  const std::scoped_lock lock(recording_mutex_);
  if (recording_ != nullptr) recording_->take_counts(batch);
}

void Output::give_frame(const FrameMessage& message) {
  const std::scoped_lock lock(recording_mutex_);
  if (recording_ != nullptr) recording_->take_frame(message);
}

void Output::reload(const OutputOptions& next) {
  checks::DetectorWatch detector = watch_of(next);  // throws before anything has changed
  fold_.reload(next.fold.pulse);
  const std::scoped_lock lock(reload_mutex_);
  reloaded_context_ = next.context;
  reloaded_scene_ = next.scene;
  reloaded_status_ = next.status;
  reloaded_detector_.emplace(std::move(detector));
}

void Output::take_reloaded() {
  const std::unique_lock lock(reload_mutex_, std::try_to_lock);
  if (!lock || !reloaded_context_) return;
  reloaded_context_->syncs_are_counted = context_.syncs_are_counted;
  context_ = *reloaded_context_;
  if (reloaded_scene_) reloaded_scene_->set_syncs_are_counted(context_.syncs_are_counted);
  scene_ = reloaded_scene_;
  reporter_.configure(reloaded_status_);
  detector_ = std::move(*reloaded_detector_);
  reloaded_context_.reset();
}

}  // namespace splid
