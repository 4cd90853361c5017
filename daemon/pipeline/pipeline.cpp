#include "daemon/pipeline/pipeline.hpp"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/output/encoder_feed.hpp"
#include "daemon/output/frame_message.hpp"
#include "daemon/output/liveness.hpp"
#include "daemon/output/status_reporter.hpp"
#include "daemon/stream/framer_thread.hpp"
#include "daemon/stream/lane.hpp"
#include "daemon/stream/lane_estimator.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/source_thread.hpp"
#include "estimator/frame_estimator.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

// Photons that the estimator has room for: 40 M/s in 50 ms, what the fastest taggers deliver. It
// thins out fuller frames.
constexpr std::size_t max_estimated_photons = std::size_t{1} << 21;

// How long the publishing thread sleeps at most before it looks after new subscribers.
constexpr milliseconds idle{50};

std::size_t ring_capacity(const Config& config) {
  return std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags));
}

}  // namespace

struct Pipeline::Stages {
  Stages(const Config& configuration, std::unique_ptr<TagSource> tag_source, Publisher& to,
         const Clock& host)
      : config(configuration),
        source(std::move(tag_source)),
        publisher(to),
        clock(host),
        ring(ring_capacity(config)),
        context(frame_context(config)),
        reporter(config, source->info(), to, host),
        liveness(config.frame.length_ms) {
    check_frame_fits(config.frame.length_ms, config.pattern, ring.capacity());
    const FrameCapacity capacity =
        frame_capacity(config.frame.length_ms, config.pattern, ring.capacity());
    max_photons = std::min(capacity.photons, max_estimated_photons);
    for (std::int64_t i = 0; i < config.pipeline.estimation_threads; ++i) {
      lanes.push_back(std::make_unique<Lane>(capacity, lane_depth));
      estimators.push_back(std::make_unique<LaneEstimator>(make_estimator(config)));
    }
    framing = std::make_unique<FramerThread>(config, source->info(), clock, ring, lanes);
    if (auto counts = open_encoder(config)) {
      encoder.emplace(std::move(counts), config.encoder, clock);
      encoder->observe([this](const EncoderBatch& batch) { record_counts(batch); });
    }
  }

  [[nodiscard]] EstimatorInUse make_estimator(const Config& from) const;
  void reload(const Config& next);
  void estimate(std::size_t index);
  void publish_all(std::stop_source& stop);
  void publish(const LaneSlot& slot);
  void record_counts(const EncoderBatch& batch);
  void tell_observer(const FrameMessage& message, const std::string& json);
  [[nodiscard]] StreamHealth health();
  void take_reloaded_context();
  void look_around();
  [[nodiscard]] StreamTotals totals() const;
  [[nodiscard]] std::vector<SourceCounter> counters() const;
  void refresh_metrics();
  void finish(const std::exception_ptr& fault);

  const Config& config;
  std::unique_ptr<TagSource> source;
  Publisher& publisher;
  const Clock& clock;
  TagRing ring;
  FrameContext context;
  StatusReporter reporter;
  Lanes lanes;
  std::size_t max_photons = 0;
  std::vector<std::unique_ptr<LaneEstimator>> estimators;
  std::unique_ptr<FramerThread> framing;
  Wake publisher_wake;                 // a frame was estimated
  std::optional<EncoderFeed> encoder;  // publisher only
  DeviceMonitor* device = nullptr;
  std::mutex recording_mutex;         // the framer never takes it
  RecordingTap* recording = nullptr;  // under the mutex
  ServiceNotifier* notifier = nullptr;
  Metrics* metrics = nullptr;
  Liveness liveness;
  std::mutex reload_mutex;
  std::optional<FrameContext> reloaded_context;  // under the mutex
  Effort reloaded_effort = Effort::balanced;     // likewise
  FrameObserver observer;
  bool observer_done = false;
  std::exception_ptr observer_fault;
  std::string sync_fault;  // empty: none found
  PipelineSummary summary;
  StreamSoFar before;
  std::stop_source own_stop;
  std::atomic<bool> pause_asked{false};
  std::optional<SourceThread> source_thread;  // from run() on
};

Pipeline::Pipeline(const Config& config, std::unique_ptr<TagSource> source, Publisher& publisher,
                   const Clock& clock)
    : stages_(std::make_unique<Stages>(config, std::move(source), publisher, clock)) {}

Pipeline::~Pipeline() {
  if (stages_->device != nullptr) stages_->device->set_wake(nullptr);
}

void Pipeline::observe(FrameObserver observer) { stages_->observer = std::move(observer); }

void Pipeline::watch(DeviceMonitor& device) {
  stages_->device = &device;
  device.set_wake(&stages_->publisher_wake);
}

void Pipeline::record(RecordingTap* recording) {
  Stages& stages = *stages_;
  if (recording != nullptr && stages.encoder) recording->expect_counts();
  {
    const std::scoped_lock lock(stages.recording_mutex);
    stages.recording = recording;
  }
  stages.framing->record_into(recording);
  if (recording == nullptr) stages.framing->wait_for_recording();
}

void Pipeline::go_on_from(const StreamSoFar& before) {
  stages_->before = before;
  stages_->reporter.go_on_from(before.status);
}

StreamSoFar Pipeline::so_far() const {
  StreamSoFar so_far{stages_->reporter.status(), stages_->totals(), stages_->counters()};
  so_far.status.tags = so_far.totals.framer.events;
  return so_far;
}

void Pipeline::pause() {
  stages_->pause_asked = true;
  stages_->own_stop.request_stop();
}

void Pipeline::serve(ServiceNotifier& notifier) { stages_->notifier = &notifier; }

void Pipeline::measure(Metrics& metrics) { stages_->metrics = &metrics; }

void Pipeline::reload(const Config& config) { stages_->reload(config); }

PipelineSummary Pipeline::run(const std::stop_token& stop) {
  Stages& stages = *stages_;
  std::stop_source& own_stop = stages.own_stop;
  const std::stop_callback pass_on(stop, [&own_stop] { own_stop.request_stop(); });
  stages.reporter.start();
  std::vector<std::jthread> threads;
  threads.emplace_back(
      [&stages, token = own_stop.get_token()] { stages.framing->run(token, stop_patience_ms); });
  for (std::size_t i = 0; i < stages.lanes.size(); ++i) {
    threads.emplace_back([&stages, i] { stages.estimate(i); });
  }
  SourceThread& source =
      stages.source_thread.emplace(*stages.source, stages.ring, own_stop.get_token());
  stages.publish_all(own_stop);
  source.join();
  threads.clear();
  stages.summary.paused = stages.pause_asked && !stop.stop_requested() && !source.fault();
  stages.finish(source.fault());
  if (stages.observer_fault) std::rethrow_exception(stages.observer_fault);
  return stages.summary;
}

EstimatorInUse Pipeline::Stages::make_estimator(const Config& from) const {
  return {FrameEstimator(config.pattern, from.pulse, from.scene, from.estimator,
                         config.frame.length_ms, max_photons),
          from.estimator.tracked};
}

void Pipeline::Stages::reload(const Config& next) {
  const std::scoped_lock lock(reload_mutex);
  std::vector<EstimatorInUse> made;
  for (std::size_t i = 0; i < lanes.size(); ++i) made.push_back(make_estimator(next));
  for (std::size_t i = 0; i < lanes.size(); ++i) estimators[i]->hand_in(std::move(made[i]));
  framing->configured_effort = next.estimator.effort;
  reloaded_context = frame_context(next);
  reloaded_effort = next.estimator.effort;
}

void Pipeline::Stages::estimate(std::size_t index) {
  pthread_setname_np(pthread_self(), ("estimate-" + std::to_string(index)).c_str());
  Lane& lane = *lanes[index];
  LaneEstimator& estimator = *estimators[index];
  TargetTrack track;
  while (!lane.estimator_done()) {
    LaneSlot* slot = lane.filled_slot();
    if (slot == nullptr) {
      lane.estimator_wake.wait_for(milliseconds{100});
      continue;
    }
    if (estimator.take_next()) track = {};
    const std::int64_t begin_ns = clock.steady_ns();
    slot->estimate = estimator.in_use().estimator.estimate(
        slot->frame.view(), estimator.in_use().tracked ? &track : nullptr, slot->effort);
    slot->compute_ms = static_cast<double>(clock.steady_ns() - begin_ns) / 1e6;
    lane.estimated();
    publisher_wake.notify();
  }
  publisher_wake.notify();
}

// Frames were dealt out in turn, so the first lane without a next frame ends them all.
void Pipeline::Stages::publish_all(std::stop_source& stop) {
  for (std::size_t next = 0; !lanes[next]->publisher_done();) {
    LaneSlot* slot = lanes[next]->estimated_slot();
    if (slot == nullptr) {
      publisher_wake.wait_for(idle);
    } else {
      publish(*slot);
      lanes[next]->release();
      framing->notify_released();
      next = (next + 1) % lanes.size();
      if (observer_done) stop.request_stop();
    }
    look_around();
  }
}

void Pipeline::Stages::publish(const LaneSlot& slot) {
  const auto reference = encoder ? encoder->reference(slot.frame) : std::nullopt;
  const double latency_ms = static_cast<double>(clock.steady_ns() - slot.frame.arrival_ns) / 1e6;
  FrameMessage message =
      make_frame_message(slot.frame, slot.estimate, context,
                         {slot.mid_unix_s, slot.compute_ms, latency_ms, slot.effort});
  message.reference = reference;
  message.sequence += before.status.frames;
  const std::string json = to_json(message);
  publisher.publish_frame(json);
  ++summary.frames;
  ++summary.frames_by_status[static_cast<std::size_t>(message.status)];
  if (message.valid()) ++summary.valid_frames;
  summary.computed_ms += slot.compute_ms;
  summary.lasted_ms += message.duration_ms;
  if (message.pattern_fault) {
    ++summary.contradicted_frames;
    summary.pattern_fault = *message.pattern_fault;
  }
  if (slot.frame.sync.locked) ++summary.locked_frames;
  summary.lost_tags += slot.frame.lost_tags;
  reporter.frame_published(message);
  if (metrics != nullptr) metrics->frame_published(message, reporter.effort_is_lowered());
  tell_observer(message, json);
}

void Pipeline::Stages::record_counts(const EncoderBatch& batch) {
  const std::scoped_lock lock(recording_mutex);
  if (recording != nullptr) recording->take_counts(batch);
}

// An observer that fails ends the stream like one that has enough; what is on its way is still
// published, so that no stage waits for another that is gone.
void Pipeline::Stages::tell_observer(const FrameMessage& message, const std::string& json) {
  if (!observer || observer_done) return;
  try {
    observer_done = !observer(message, json);
  } catch (...) {
    observer_fault = std::current_exception();
    observer_done = true;
  }
}

StreamHealth Pipeline::Stages::health() {
  StreamHealth health;
  health.tags = before.totals.framer.events + framing->totals_so_far().events;
  health.last_arrival_ns = framing->last_arrival_ns.load(std::memory_order_relaxed);
  health.ring_fill_ratio =
      static_cast<double>(framing->highest_fill.exchange(0)) / static_cast<double>(ring.capacity());
  health.sync_fault = sync_fault;
  if (device != nullptr) {
    health.device_reports = device->take_reports();
    health.notices = device->take_notices();
    health.configuration_fault = device->configuration_fault();
  }
  // After the notices, so that none is of a fault that is not here.
  const std::scoped_lock lock(recording_mutex);
  if (recording != nullptr) health.recording_fault = recording->fault();
  return health;
}

void Pipeline::Stages::take_reloaded_context() {
  const std::unique_lock lock(reload_mutex, std::try_to_lock);
  if (!lock || !reloaded_context) return;
  context = *reloaded_context;
  reporter.configure(reloaded_effort);
  reloaded_context.reset();
}

void Pipeline::Stages::look_around() {
  if (sync_fault.empty() && framing->diagnosed.load(std::memory_order_acquire)) {
    sync_fault = in_words(*framing->diagnosis());
    spdlog::warn("{}", sync_fault);
  }
  take_reloaded_context();
  const StreamHealth now = health();
  reporter.tick(now);
  if (notifier != nullptr) {
    const WorkSeen seen{summary.frames, ring.touches(), ring.fill() == 0, source->info().live};
    notifier->tick(reporter.status(), liveness.is_alive(seen, clock.steady_ns()));
  }
  if (metrics == nullptr) return;
  metrics->ring_filled(now.ring_fill_ratio);
  if (metrics->due()) refresh_metrics();
}

StreamTotals Pipeline::Stages::totals() const {
  return {added_up(before.totals.framer, framing->totals_so_far()),
          before.totals.dropped_tags + source_thread->dropped_tags(),
          before.totals.discarded_tags + framing->discarded()};
}

std::vector<SourceCounter> Pipeline::Stages::counters() const {
  std::vector<SourceCounter> all = source->counters();
  for (std::size_t i = 0; i < std::min(all.size(), before.counters.size()); ++i) {
    all[i].value += before.counters[i].value;
  }
  return all;
}

void Pipeline::Stages::refresh_metrics() {
  metrics->refresh(reporter.status(), totals(), counters());
}

void Pipeline::Stages::finish(const std::exception_ptr& fault) {
  summary.tags = framing->totals();
  summary.discarded_tags = framing->discarded();
  summary.diagnosis = framing->diagnosis();
  summary.fault = fault;
  std::string reason;
  try {
    if (fault) std::rethrow_exception(fault);
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (summary.paused) {
    reporter.tick(health());
  } else {
    reporter.stop(health(), reason);
  }
  if (notifier != nullptr) notifier->tick(reporter.status(), true);
  if (metrics != nullptr) refresh_metrics();
}

}  // namespace splid
