#include "daemon/service/measuring.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/service/reload.hpp"
#include "daemon/service/session_report.hpp"
#include "daemon/stream/open_source.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::chrono::milliseconds idle{50};

// What systemd waits for is 5 s (systemd/splid.service), and frames on their way take half of a
// second or the time of one estimate.
constexpr std::chrono::milliseconds patience_with_disk{2000};

constexpr const char* ending = "the daemon ends";

// What an error says; empty where there is none.
std::string sentence_of(const std::exception_ptr& fault) {
  try {
    if (fault) std::rethrow_exception(fault);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

// Errors: those of Stream::Make, beginning with the file.
NewEstimators made_by(const Stream::Make& make, const Config& next, const std::stop_token& stop) {
  return asked_by(next.file, [&] { return make(stop); });
}

}  // namespace

Measuring::Measuring(const Config& config, Output& output, DeviceMonitor& device, bool may_record)
    : config_(config),
      output_(output),
      device_(device),
      to_record_(may_record && !config.record.folder.empty() &&
                 config.record.when == RecordWhen::always) {}

StreamSummary Measuring::run(std::unique_ptr<TagSource> source, const std::stop_token& stop) {
  prepare(std::move(source));
  StreamSummary summary;
  do {
    summary = measure(stop);
  } while (summary.paused && wait_until_wanted(stop));
  const std::scoped_lock lock(mutex_);
  over_ = true;
  changed_.notify_all();
  return summary;
}

// From here on there is a stream, which is what start() waits for.
void Measuring::prepare(std::unique_ptr<TagSource> source) {
  auto stream = asked_by(config_.file, [&] {
    return std::make_unique<Stream>(stream_options(config_), std::move(source), host_clock());
  });
  output_.begin();
  const std::scoped_lock recording_lock(recording_mutex_);
  if (to_record_) record(*stream);
  const std::scoped_lock lock(mutex_);
  if (reloaded_) {
    stream->reload(made_by(stream->maker(stream_options(*reloaded_)), *reloaded_, {}));
  }
  stream_ = std::move(stream);
  ++streams_;
  waits_for_.clear();
  pausing_ = !wanted_;
  if (pausing_) stream_->request_stop();
  changed_.notify_all();
}

StreamSummary Measuring::measure(const std::stop_token& stop) {
  const std::int64_t begin_ns = host_clock().steady_ns();
  StreamSummary summary;
  {
    const std::stop_callback pass_on(stop, [this] { hurry(); });
    summary = output_.publish(*stream_);
  }
  {
    const std::scoped_lock lock(mutex_);
    summary.paused = pausing_ && !stop.stop_requested() && !summary.fault;
  }
  if (!summary.paused) output_.stop(sentence_of(summary.fault));
  const double took_s = static_cast<double>(host_clock().steady_ns() - begin_ns) / 1e9;
  log_info("{}; took {:.3g} s", in_words(summary), took_s);
  const std::scoped_lock recording_lock(recording_mutex_);
  finish_recording();
  const std::scoped_lock lock(mutex_);
  stream_.reset();
  return summary;
}

void Measuring::hurry() {
  stream_->request_stop();
  const std::scoped_lock lock(mutex_);
  if (recording_) recording_->hurry();
}

// Returns false where the daemon is to end before it measures again.
bool Measuring::wait_until_wanted(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  log_info("the source is closed: {}", reason_);
  while (!stop.stop_requested()) {
    const std::string reason = reason_;
    const bool wanted = wanted_;
    lock.unlock();
    if (wanted && resume()) return true;
    output_.wait(reason);
    lock.lock();
    waits_for_ = reason;
    changed_.notify_all();
    changed_.wait_for(lock, stop, idle, [&] { return wanted_ || reason_ != reason; });
  }
  lock.unlock();
  output_.stop("");
  return false;
}

bool Measuring::resume() {
  try {
    (void)device_.take_reports();  // of the source that was closed
    prepare(open_source(config_, device_.hears()));
    log_info("measuring again from {}", stream_->info().name);
    return true;
  } catch (const Error& error) {
    give_up(error.fault(), error.what());
  } catch (const std::exception& error) {
    give_up(Fault::device, error.what());
  }
  return false;
}

void Measuring::give_up(Fault fault, const std::string& sentence) {
  const std::scoped_lock lock(mutex_);
  failure_ = fault;
  wanted_ = false;
  reason_ = sentence;
  changed_.notify_all();
}

bool Measuring::start(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (stream_ && wanted_) return false;
  wanted_ = true;
  failure_.reset();
  changed_.notify_all();
  changed_.wait(lock, stop, [this] { return stream_ || failure_ || over_; });
  if (failure_) throw Error(*failure_, reason_);
  if (!stream_) throw Error(Fault::usage, ending);
  return true;
}

bool Measuring::pause(const std::string& reason, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const bool waited = !waits_for_.empty();
  reason_ = reason;
  wanted_ = false;
  if (stream_) {
    pausing_ = true;
    stream_->request_stop();
  }
  changed_.notify_all();
  changed_.wait(lock, stop, [&] { return waits_for_ == reason || over_; });
  if (waits_for_ != reason) throw Error(Fault::usage, ending);
  return !waited;
}

// Estimators may take seconds to make, in which a stream may end and another begin. While there is
// no stream they are only tried, so that a configuration that they refuse does not keep the next
// stream from beginning.
void Measuring::reload(const Config& given, const std::stop_token& stop) {
  Config next = with_live(config_, given);
  std::unique_lock lock(mutex_);
  if (!stream_) {
    lock.unlock();
    asked_by(next.file, [&] { check_stream(stream_options(next)); });
    lock.lock();
  }
  NewEstimators made;
  for (std::uint64_t of_stream = 0; stream_ && of_stream != streams_;) {
    of_stream = streams_;
    const Stream::Make make = stream_->maker(stream_options(next));
    lock.unlock();
    made = made_by(make, next, stop);
    lock.lock();
  }
  output_.reload(output_options(next));  // the last that may throw
  if (stream_) stream_->reload(std::move(made));
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
  if (stream_) record(*stream_);
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
  output_.record(nullptr);
  if (stream_) stream_->tap_into(nullptr);
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
  return stream_ != nullptr;
}

// Under the recording's mutex, and not under the other mutex: a recording's ring takes a while to
// make.
void Measuring::record(Stream& stream) {
  auto made = std::make_unique<recording::Tap>(config_, stream.info(), host_clock(),
                                               [this](const std::string& sentence) {
                                                 log_warning("recording: {}", sentence);
                                                 device_.notice("recording: " + sentence);
                                               });
  output_.record(made.get());
  stream.tap_into(made.get());
  const std::scoped_lock lock(mutex_);
  recording_ = std::move(made);
}

// Under the recording's mutex, and not under the other mutex: the recording waits for the disk.
// Nothing gives it tags any more.
void Measuring::finish_recording() {
  if (!recording_) return;
  output_.record(nullptr);
  std::unique_ptr<recording::Tap> tap;
  {
    const std::scoped_lock lock(mutex_);
    recording_file_ = recording_->file();
    tap = std::move(recording_);
  }
  recording::Ended ended = recording::end_within(std::move(tap), patience_with_disk);
  if (ended.whole) {
    log_info(ended.text);
  } else {
    log_warning(ended.text);
  }
  const std::scoped_lock lock(mutex_);
  recording_file_ = std::move(ended.file);
}

}  // namespace splid
