#include "daemon/service/measuring.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "daemon/base/clock.hpp"
#include "daemon/service/session_report.hpp"
#include "daemon/stream/open_source.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::chrono::milliseconds idle{50};

constexpr const char* ending = "the daemon ends";

}  // namespace

Measuring::Measuring(const Config& config, Publisher& publisher, DeviceMonitor& device,
                     Metrics* metrics, FrameObserver observer, bool may_record)
    : config_(config),
      publisher_(publisher),
      device_(device),
      metrics_(metrics),
      observer_(std::move(observer)),
      notifier_(host_clock()),
      to_record_(may_record && !config.record.folder.empty() &&
                 config.record.when == RecordWhen::always) {}

PipelineSummary Measuring::run(std::unique_ptr<TagSource> source, const std::stop_token& stop) {
  prepare(std::move(source));
  PipelineSummary summary;
  do {
    summary = measure(stop);
  } while (summary.paused && wait_until_wanted(stop));
  const std::scoped_lock lock(mutex_);
  over_ = true;
  changed_.notify_all();
  return summary;
}

// What start() waits for: from here on there is a pipeline.
void Measuring::prepare(std::unique_ptr<TagSource> source) {
  const SourceInfo info = source->info();
  auto pipeline = std::make_unique<Pipeline>(config_, std::move(source), publisher_, host_clock());
  pipeline->go_on_from(so_far_);
  if (metrics_ != nullptr) pipeline->measure(*metrics_);
  pipeline->watch(device_);
  pipeline->serve(notifier_);
  pipeline->observe(observer_);
  const std::scoped_lock recording_lock(recording_mutex_);
  if (to_record_) record(*pipeline, info);
  const std::scoped_lock lock(mutex_);
  if (reloaded_) pipeline->reload(*reloaded_);
  source_ = info;
  pipeline_ = std::move(pipeline);
  waits_for_.clear();
  if (!wanted_) pipeline_->pause();
  changed_.notify_all();
}

PipelineSummary Measuring::measure(const std::stop_token& stop) {
  const std::int64_t begin_ns = host_clock().steady_ns();
  PipelineSummary summary = pipeline_->run(stop);
  const double took_s = static_cast<double>(host_clock().steady_ns() - begin_ns) / 1e9;
  spdlog::info("{}; took {:.3g} s", in_words(summary), took_s);
  so_far_ = pipeline_->so_far();
  const std::scoped_lock recording_lock(recording_mutex_);
  finish_recording();
  const std::scoped_lock lock(mutex_);
  pipeline_.reset();
  return summary;
}

// False where the daemon is to end instead.
bool Measuring::wait_until_wanted(const std::stop_token& stop) {
  PauseStatus status(publisher_, device_, notifier_, metrics_, host_clock(), source_.live);
  std::unique_lock lock(mutex_);
  spdlog::info("the source is closed: {}", reason_);
  while (!stop.stop_requested()) {
    const std::string reason = reason_;
    const bool wanted = wanted_;
    lock.unlock();
    if (wanted && resume()) return true;
    status.tick(so_far_, reason);
    lock.lock();
    waits_for_ = reason;
    changed_.notify_all();
    changed_.wait_for(lock, stop, idle, [&] { return wanted_ || reason_ != reason; });
  }
  lock.unlock();
  status.stop(so_far_);
  return false;
}

bool Measuring::resume() {
  try {
    (void)device_.take_reports();  // of the source that was closed
    prepare(open_source(config_, device_.hears()));
    spdlog::info("measuring again from {}", source_.name);
    return true;
  } catch (const std::exception& error) {
    const std::scoped_lock lock(mutex_);
    failure_ = std::current_exception();
    wanted_ = false;
    reason_ = error.what();
    changed_.notify_all();
    return false;
  }
}

bool Measuring::start(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (pipeline_ && wanted_) return false;
  wanted_ = true;
  failure_ = nullptr;
  changed_.notify_all();
  changed_.wait(lock, stop, [this] { return pipeline_ || failure_ || over_; });
  if (failure_) std::rethrow_exception(failure_);
  if (!pipeline_) throw Error(Fault::usage, ending);
  return true;
}

bool Measuring::pause(const std::string& reason, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const bool waited = !waits_for_.empty();
  reason_ = reason;
  wanted_ = false;
  if (pipeline_) pipeline_->pause();
  changed_.notify_all();
  changed_.wait(lock, stop, [&] { return waits_for_ == reason || over_; });
  if (waits_for_ != reason) throw Error(Fault::usage, ending);
  return !waited;
}

void Measuring::reload(std::shared_ptr<const Config> next) {
  const std::scoped_lock lock(mutex_);
  if (pipeline_) pipeline_->reload(*next);
  reloaded_ = std::move(next);
}

bool Measuring::record() {
  if (config_.record.folder.empty()) {
    throw Error(Fault::usage, config_.file +
                                  ": /record/folder: names no folder to record into; give one, and "
                                  "/record/when \"asked\", and restart");
  }
  const std::scoped_lock recording_lock(recording_mutex_);
  if (to_record_) return false;
  if (pipeline_) record(*pipeline_, source_);
  const std::scoped_lock lock(mutex_);
  to_record_ = true;
  recording_file_.clear();
  return true;
}

bool Measuring::end_recording() {
  const std::scoped_lock recording_lock(recording_mutex_);
  {
    const std::scoped_lock lock(mutex_);
    if (!std::exchange(to_record_, false)) return false;
  }
  if (pipeline_) pipeline_->record(nullptr);
  finish_recording();
  return true;
}

std::string Measuring::recording_file() const {
  const std::scoped_lock lock(mutex_);
  const std::string file = recording_ ? recording_->file() : "";
  return file.empty() ? recording_file_ : file;
}

bool Measuring::records() const {
  const std::scoped_lock lock(mutex_);
  return to_record_;
}

bool Measuring::measures() const {
  const std::scoped_lock lock(mutex_);
  return pipeline_ != nullptr;
}

// Under the recording's mutex, and not under the other: its ring takes a while to make.
void Measuring::record(Pipeline& pipeline, const SourceInfo& source) {
  auto made = std::make_unique<RecordingTap>(config_, source, host_clock(),
                                             [this](const std::string& sentence) {
                                               spdlog::warn("recording: {}", sentence);
                                               device_.notice("recording: " + sentence);
                                             });
  pipeline.record(made.get());
  const std::scoped_lock lock(mutex_);
  recording_ = std::move(made);
}

// Likewise: it waits for the disk. Nothing gives the recording tags any more.
void Measuring::finish_recording() {
  if (!recording_) return;
  spdlog::info("{}", recording_->summary());
  const std::scoped_lock lock(mutex_);
  recording_file_ = recording_->file();
  recording_.reset();
}

}  // namespace splid
