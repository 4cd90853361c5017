#include "daemon/pipeline.hpp"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/frame_message.hpp"
#include "daemon/framing.hpp"
#include "daemon/lane.hpp"
#include "daemon/ring.hpp"
#include "daemon/source_thread.hpp"
#include "daemon/status_reporter.hpp"
#include "estimator/frame_estimator.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

// Slots a lane: one that the framer fills while the estimator works on the other. The ring behind
// holds what comes in longer pauses, at a third of the memory.
constexpr std::size_t lane_depth = 2;

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
        reporter(config, source->info(), to, host) {
    check_frame_fits(config.frame.length_ms, config.pattern, ring.capacity());
    const FrameCapacity capacity =
        frame_capacity(config.frame.length_ms, config.pattern, ring.capacity());
    for (std::int64_t i = 0; i < config.pipeline.estimation_threads; ++i) {
      lanes.push_back(std::make_unique<Lane>(capacity, lane_depth));
      estimators.emplace_back(config.pattern, config.pulse, config.scene, config.estimator,
                              config.frame.length_ms,
                              std::min(capacity.photons, max_estimated_photons));
    }
    framing = std::make_unique<Framing>(config, source->info(), clock, ring, lanes);
  }

  void estimate(std::size_t index);
  void publish_all(std::stop_source& stop);
  void publish(const LaneSlot& slot);
  void tell_observer(const FrameMessage& message, const std::string& json);
  [[nodiscard]] StreamHealth health();
  void look_around();
  void finish(const std::exception_ptr& fault);

  const Config& config;
  std::unique_ptr<TagSource> source;
  Publisher& publisher;
  const Clock& clock;
  TagRing ring;
  FrameContext context;
  StatusReporter reporter;
  Lanes lanes;
  std::vector<FrameEstimator> estimators;
  std::unique_ptr<Framing> framing;
  Wake publisher_wake;  // a frame was estimated
  DeviceMonitor* device = nullptr;
  FrameObserver observer;
  bool observer_done = false;
  std::exception_ptr observer_fault;
  std::string sync_fault;  // empty: none found
  PipelineSummary summary;
};

Pipeline::Pipeline(const Config& config, std::unique_ptr<TagSource> source, Publisher& publisher,
                   const Clock& clock)
    : stages_(std::make_unique<Stages>(config, std::move(source), publisher, clock)) {}

Pipeline::~Pipeline() = default;

void Pipeline::observe(FrameObserver observer) { stages_->observer = std::move(observer); }

void Pipeline::watch(DeviceMonitor& device) { stages_->device = &device; }

PipelineSummary Pipeline::run(const std::stop_token& stop) {
  Stages& stages = *stages_;
  std::stop_source own_stop;
  const std::stop_callback pass_on(stop, [&own_stop] { own_stop.request_stop(); });
  stages.reporter.start();
  std::vector<std::jthread> threads;
  threads.emplace_back(
      [&stages, token = own_stop.get_token()] { stages.framing->run(token, stop_patience_ms); });
  for (std::size_t i = 0; i < stages.lanes.size(); ++i) {
    threads.emplace_back([&stages, i] { stages.estimate(i); });
  }
  SourceThread source(*stages.source, stages.ring, own_stop.get_token());
  stages.publish_all(own_stop);
  source.join();
  threads.clear();
  stages.finish(source.fault());
  if (stages.observer_fault) std::rethrow_exception(stages.observer_fault);
  return stages.summary;
}

void Pipeline::Stages::estimate(std::size_t index) {
  pthread_setname_np(pthread_self(), ("estimate-" + std::to_string(index)).c_str());
  Lane& lane = *lanes[index];
  FrameEstimator& estimator = estimators[index];
  Track track;
  while (!lane.estimator_done()) {
    LaneSlot* slot = lane.filled_slot();
    if (slot == nullptr) {
      lane.estimator_wake.wait_for(milliseconds{100});
      continue;
    }
    const std::int64_t begin_ns = clock.steady_ns();
    slot->estimate =
        estimator.estimate(slot->frame.view(), config.estimator.tracked ? &track : nullptr);
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
  const double latency_ms = static_cast<double>(clock.steady_ns() - slot.frame.arrival_ns) / 1e6;
  const FrameMessage message = make_frame_message(slot.frame, slot.estimate, context,
                                                  {slot.mid_unix_s, slot.compute_ms, latency_ms});
  const std::string json = to_json(message);
  publisher.publish_frame(json);
  ++summary.frames;
  ++summary.frames_by_status[static_cast<std::size_t>(message.status)];
  if (message.valid()) ++summary.valid_frames;
  if (slot.frame.sync.locked) ++summary.locked_frames;
  summary.lost_tags += slot.frame.lost_tags;
  reporter.frame_published(message);
  tell_observer(message, json);
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
  health.tags = framing->tags.load(std::memory_order_relaxed);
  health.last_arrival_ns = framing->last_arrival_ns.load(std::memory_order_relaxed);
  health.ring_fill_ratio =
      static_cast<double>(framing->highest_fill.exchange(0)) / static_cast<double>(ring.capacity());
  health.sync_fault = sync_fault;
  if (device != nullptr) health.device_reports = device->take();
  return health;
}

void Pipeline::Stages::look_around() {
  if (sync_fault.empty() && framing->diagnosed.load(std::memory_order_acquire)) {
    sync_fault = describe(*framing->diagnosis());
    spdlog::warn("{}", sync_fault);
  }
  publisher.greet();
  reporter.tick(health());
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
  publisher.greet();
  reporter.stop(health(), reason);
}

}  // namespace splid
