#include "daemon/service/control_actions.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>
#include <thread>
#include <utility>

#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "daemon/recording/record_source.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/study/calibration/calibration_report.hpp"
#include "daemon/study/calibration/pattern_calibration.hpp"
#include "drivers/awg/upload.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/pattern_json.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

constexpr const char* stopped_reason = "stopped by control; splid ctl start resumes";

// A live source sends something every 10 ms, and the file is begun with it.
constexpr milliseconds patience_for_file{2000};

control::Reply done(control::Command command, std::string message) {
  return {to_string(command), {}, std::move(message)};
}

void add_file(control::Reply& reply, const std::string& file) {
  if (!file.empty()) reply.more.emplace_back("file", json_string(file));
}

// Keeps a recording that is read twice and then removed in a folder of its own.
class ScratchFolder {
 public:
  ScratchFolder() {
    const char* named = std::getenv("TMPDIR");
    const std::string folder = named == nullptr || *named == 0 ? "/tmp" : named;
    path_ = folder + "/splid-calibrate-XXXXXX";
    if (::mkdtemp(path_.data()) != nullptr) return;
    throw Error(Fault::device, "no recording can be kept in " + folder + ", the daemon's TMPDIR: " +
                                   std::generic_category().message(errno) +
                                   "; set it to a folder that can be written to, and restart");
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] std::string file() const { return path_ + "/source.ptu"; }

 private:
  std::string path_;
};

}  // namespace

control::Reply ControlActions::status(const std::string& doing) {
  control::Reply reply = done(control::Command::status, "");
  reply.more.emplace_back("measuring", measuring_.measures() ? "true" : "false");
  reply.more.emplace_back("recording", measuring_.records() ? "true" : "false");
  if (measuring_.records()) add_file(reply, measuring_.recording_file());
  if (!doing.empty()) {
    reply.more.emplace_back("doing", json_string(doing));
    const std::scoped_lock lock(mutex_);
    if (!progress_.empty()) reply.more.emplace_back("progress", json_string(progress_));
  }
  const std::string status = publisher_.last_status();
  if (!status.empty()) reply.more.emplace_back("status", status);
  return reply;
}

control::Reply ControlActions::perform(const control::Request& request,
                                       const std::stop_token& stop) {
  log_info("control: {}", to_string(request.command));
  show_progress("");
  switch (request.command) {
    case control::Command::start:
      return start(stop);
    case control::Command::stop:
      return this->stop(stop);
    case control::Command::record_start:
      return record(stop);
    case control::Command::record_stop:
      return end_recording();
    case control::Command::upload:
      return upload_pattern(stop);
    case control::Command::calibrate:
      return calibrate(request.calibrate, stop);
    case control::Command::status:
      break;
  }
  return status("");
}

control::Reply ControlActions::start(const std::stop_token& stop) {
  return done(control::Command::start,
              measuring_.start(stop) ? "measuring" : "it is measuring already");
}

control::Reply ControlActions::stop(const std::stop_token& stop) {
  return done(control::Command::stop, measuring_.pause(stopped_reason, stop)
                                          ? "stopped; the source is closed"
                                          : "it is stopped already");
}

control::Reply ControlActions::record(const std::stop_token& stop) {
  const bool is_new = measuring_.record();
  const auto end = std::chrono::steady_clock::now() + patience_for_file;
  while (measuring_.measures() && measuring_.recording_file().empty() && !stop.stop_requested() &&
         std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(milliseconds{5});
  }
  const std::string file = measuring_.recording_file();
  control::Reply reply =
      done(control::Command::record_start,
           (is_new ? "recording into " : "it is recording already, into ") +
               (file.empty() ? config_.record.folder + " from the next tag on" : file));
  add_file(reply, file);
  return reply;
}

control::Reply ControlActions::end_recording() {
  const bool recorded = measuring_.end_recording();
  const std::string file = measuring_.recording_file();
  control::Reply reply = done(control::Command::record_stop, "it records nothing");
  if (!recorded) return reply;
  reply.message = file.empty() ? "nothing was recorded" : "recorded; the last file is " + file;
  add_file(reply, file);
  return reply;
}

control::Reply ControlActions::upload_pattern(const std::stop_token& stop) {
  const awg::Uploaded uploaded = awg::upload(
      config_.awg, config_.pattern,
      [this](const char* what, double part) {
        show_progress(fmt::format("{}, {:.0f} %", what, 100 * part));
      },
      stop);
  control::Reply reply = done(control::Command::upload, in_words(uploaded));
  reply.more.emplace_back("pattern", to_json(uploaded.played));
  return reply;
}

// Whether the calibration succeeds or fails, measuring goes on as it was.
control::Reply ControlActions::calibrate(const control::CalibrateRequest& request,
                                         const std::stop_token& stop) {
  const bool measured = measuring_.pause("calibrating; it measures again afterwards", stop);
  try {
    control::Reply reply = calibrate_from_source(request, stop);
    reply.message += go_on(measured, stop);
    return reply;
  } catch (const Error& error) {
    throw Error(error.fault(), error.what() + go_on(measured, stop));
  } catch (const std::bad_alloc&) {
    throw Error(Fault::device, "there is not enough memory to calibrate" + go_on(measured, stop));
  } catch (const std::exception& error) {
    throw Error(Fault::device, error.what() + go_on(measured, stop));
  }
}

// Why measuring does not go on, as the end of a sentence; empty where it does.
std::string ControlActions::go_on(bool measured, const std::stop_token& stop) {
  try {
    if (stop.stop_requested()) return "";
    if (measured) {
      measuring_.start(stop);
    } else {
      measuring_.pause(stopped_reason, stop);
    }
    return "";
  } catch (const std::exception& error) {
    return std::string("; it does not measure again: ") + error.what();
  }
}

control::Reply ControlActions::calibrate_from_source(const control::CalibrateRequest& request,
                                                     const std::stop_token& stop) {
  const ScratchFolder scratch;
  const std::unique_ptr<TagSource> source = open_source(config_);
  calibration::Plan plan;
  plan.recording = fmt::format("{:g} s of ", request.seconds) + source->info().name;
  plan.goal = {request.time_ps, request.amplitude_percent / 100};
  plan.distance_m = request.distance_m;
  recording::Limit limit;
  limit.seconds = request.seconds;
  limit.progress = [this](double seconds) {
    show_progress(fmt::format("{:.1f} s taken", seconds));
  };
  recording::record_source(config_, *source, scratch.file(), true, host_clock(), stop, limit);
  const calibration::PatternCalibration calibrated = calibration::calibrate_recording(
      config_, scratch.file(), plan,
      [this](const char* what, double seconds) {
        show_progress(std::string(what) + fmt::format(", {:.1f} s", seconds));
      },
      stop);
  control::Reply reply =
      done(control::Command::calibrate,
           calibration::summary(calibrated, "PATTERN.json", config_.frame.length_ms));
  reply.more.emplace_back("pattern", to_json(calibrated.pattern));
  return reply;
}

void ControlActions::show_progress(const std::string& text) {
  const std::scoped_lock lock(mutex_);
  progress_ = text;
}

}  // namespace splid
