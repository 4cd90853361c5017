#include "daemon/service/session.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <utility>

#include "daemon/clock.hpp"
#include "daemon/format.hpp"
#include "daemon/line_writer.hpp"
#include "daemon/messages/publisher.hpp"
#include "daemon/progress.hpp"
#include "daemon/recording/recording.hpp"
#include "daemon/security/server_security.hpp"
#include "daemon/service/reload.hpp"
#include "daemon/service/service_notifier.hpp"
#include "daemon/truth_score.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

// Syncs a frame from which on they are plentiful: a frame locks from three that agree.
constexpr std::uint64_t plentiful_syncs = 16;

void wait_for_subscriber(Publisher& publisher, double seconds, const std::stop_token& stop) {
  if (seconds <= 0) return;
  constexpr double slice_s = 0.1;
  for (double left_s = seconds; left_s > 0 && !stop.stop_requested(); left_s -= slice_s) {
    if (publisher.wait_for_subscriber(std::chrono::milliseconds{100})) return;
  }
  if (!stop.stop_requested()) spdlog::warn("nobody subscribed within {} s; going on", seconds);
}

std::string describe(const FrameMessage& message) {
  std::string text =
      format("frame %s, %s", grouped(message.sequence).c_str(), to_string(message.status));
  if (message.distance_m) text += format(", %.4f m", *message.distance_m);
  if (message.velocity_mps) text += format(", %+.3f m/s", *message.velocity_mps);
  return text;
}

std::string describe(const PipelineSummary& summary) {
  std::string text = grouped(summary.frames) + " frames";
  const char* separator = ": ";
  for (std::size_t i = 0; i < summary.frames_by_status.size(); ++i) {
    if (summary.frames_by_status[i] == 0) continue;
    text += separator + grouped(summary.frames_by_status[i]) + " " +
            to_string(static_cast<FrameStatus>(i));
    separator = ", ";
  }
  const FramerTotals& tags = summary.tags;
  text += "; " + grouped(tags.events) + " tags: " + grouped(tags.photons) + " photons, " +
          grouped(tags.syncs) + " syncs, " + grouped(tags.ignored) + " on channels not used; " +
          grouped(summary.lost_tags + summary.discarded_tags) + " lost";
  return text;
}

void check_locked(const PipelineSummary& summary) {
  if (summary.frames == 0 || summary.locked_frames > 0) return;
  if (summary.diagnosis) throw Error(Fault::data, describe(*summary.diagnosis));
  if (summary.tags.syncs >= plentiful_syncs * summary.frames) {
    throw Error(Fault::data, "no frame could lock: there are " + grouped(summary.tags.syncs) +
                                 " syncs, but they do not come at the pattern's period; give "
                                 "pattern.file the pattern that was played");
  }
  spdlog::warn("no frame could lock: {} syncs in {} frames; look at channels.sync",
               summary.tags.syncs, summary.frames);
}

std::string joined(const std::vector<std::string>& pointers) {
  std::string text;
  for (const std::string& pointer : pointers) text += (text.empty() ? "" : ", ") + pointer;
  return text;
}

// Reads the configuration anew on SIGHUP and says, in the log and in the status, what came of it.
class Reloader {
 public:
  // All outlive this. authenticator: null where there is none.
  Reloader(const Config& config, Pipeline& pipeline, DeviceMonitor& device,
           Authenticator* authenticator)
      : original_(config), pipeline_(pipeline), device_(device), authenticator_(authenticator) {}

  void reload() {
    notifier_.reloading();
    try {
      auto next = std::make_unique<Config>(load_config(original_.file));
      const ConfigChanges since_start = changes_between(original_, *next);
      const ConfigChanges now = changes_between(in_use_ ? *in_use_ : original_, *next);
      const std::string allowed = authenticator_ == nullptr || next->security.allow_list.empty()
                                      ? ""
                                      : reload_allow_list(*authenticator_, next->security);
      if (!now.live.empty()) pipeline_.reload(*next);
      in_use_ = std::move(next);
      std::string what = joined(now.live);
      if (!allowed.empty()) what += (what.empty() ? "" : "; ") + allowed;
      say(spdlog::level::info,
          "reloaded " + original_.file + ": " + (what.empty() ? "nothing new" : what));
      if (!since_start.restart.empty()) {
        say(spdlog::level::warn, "takes a restart: " + joined(since_start.restart));
      }
    } catch (const Error& error) {
      say(spdlog::level::err, std::string("not reloaded, going on as before: ") + error.what());
    }
    notifier_.reloaded();
  }

 private:
  void say(spdlog::level::level_enum level, const std::string& sentence) {
    spdlog::log(level, "{}", sentence);
    device_.notice(sentence);
  }

  const Config& original_;
  std::unique_ptr<Config> in_use_;  // null: the original
  Pipeline& pipeline_;
  DeviceMonitor& device_;
  Authenticator* authenticator_;
  ServiceNotifier notifier_{host_clock()};
};

std::string where(const Publisher& publisher, const Authenticator* authenticator) {
  std::string text = publisher.endpoint();
  if (authenticator != nullptr) text += " (CURVE, public key " + authenticator->public_key() + ")";
  const std::string& local = publisher.local_endpoint();
  return local.empty() ? text : text + " and, for this machine, at " + local;
}

// Null where nobody is to be told any.
std::unique_ptr<Metrics> open_metrics(const Config& config, const TagSource& source,
                                      DeviceMonitor& device) {
  if (config.metrics.file.empty() && config.metrics.http.empty()) return nullptr;
  auto metrics = std::make_unique<Metrics>(config, source.counters(), host_clock(),
                                           [&device](const std::string& sentence) {
                                             spdlog::warn("{}", sentence);
                                             device.notice(sentence);
                                           });
  if (!metrics->url().empty()) spdlog::info("metrics at {}", metrics->url());
  return metrics;
}

// Takes a signals' hangup for as long as it lives.
class HangupTaken {
 public:
  HangupTaken(StopSignals* signals, std::function<void()> action) : signals_(signals) {
    if (signals_ != nullptr) signals_->on_hangup(std::move(action));
  }
  ~HangupTaken() {
    if (signals_ != nullptr) signals_->on_hangup(nullptr);
  }
  HangupTaken(const HangupTaken&) = delete;
  HangupTaken& operator=(const HangupTaken&) = delete;

 private:
  StopSignals* signals_;
};

}  // namespace

std::unique_ptr<TagSource> open_source(const Config& config, DeviceMonitor* device) {
  SourceContext context;
  context.pattern = &config.pattern;
  context.warn = [](const std::string& sentence) { spdlog::warn("{}", sentence); };
  context.report = [device](const DeviceReport& report) {
    const bool is_well = report.state == DeviceState::connected;
    if (!report.reason.empty()) {
      spdlog::log(is_well ? spdlog::level::info : spdlog::level::warn, "{}: {}",
                  to_string(report.state), report.reason);
    }
    if (device != nullptr) device->report(report);
  };
  return config.source->open(context);
}

int run_session(const Config& config, std::unique_ptr<TagSource> source, DeviceMonitor& device,
                const SessionOptions& options, const std::stop_token& stop) {
  const SourceInfo info = source->info();
  const auto authenticator = open_authenticator(
      config.security, [](const std::string& sentence) { spdlog::warn("{}", sentence); },
      host_clock());
  Publisher publisher(config.publish.endpoint, options.queue_messages,
                      {config.publish.local_endpoint, authenticator.get()});
  const std::unique_ptr<Metrics> metrics = open_metrics(config, *source, device);
  Pipeline pipeline(config, std::move(source), publisher, host_clock());
  if (metrics) pipeline.measure(*metrics);
  pipeline.watch(device);
  std::optional<Recording> recording;
  if (options.record && !config.record.folder.empty()) {
    recording.emplace(config, info, host_clock(), [&device](const std::string& sentence) {
      spdlog::warn("recording: {}", sentence);
      device.notice("recording: " + sentence);
    });
    pipeline.record(*recording);
  }
  ServiceNotifier notifier(host_clock());
  pipeline.serve(notifier);
  Reloader reloader(config, pipeline, device, authenticator.get());
  const HangupTaken hangup(options.signals, [&reloader] { reloader.reload(); });
  LineWriter out(stdout, "standard output");
  Progress progress(host_clock());
  EncoderScore encoder;
  pipeline.observe([&](const FrameMessage& message, const std::string& json) {
    encoder.take(message);
    if (progress.due()) progress.show(describe(message));
    return !options.json || out.write(json);
  });
  spdlog::info("source {}; pattern {} ({}); publishing at {}", info.name, config.pattern_file,
               describe_pattern(config.pattern), where(publisher, authenticator.get()));
  wait_for_subscriber(publisher, options.wait_for_subscriber_s, stop);
  const std::int64_t begin_ns = host_clock().steady_ns();
  const PipelineSummary summary = pipeline.run(stop);
  progress.clear();
  const double took_s = static_cast<double>(host_clock().steady_ns() - begin_ns) / 1e9;
  spdlog::info("{}; took {:.3g} s", describe(summary), took_s);
  if (recording) spdlog::info("{}", recording->summary());
  if (encoder.compared() > 0) spdlog::info("{}", encoder.summary());
  if (summary.fault) std::rethrow_exception(summary.fault);
  check_locked(summary);
  return 0;
}

}  // namespace splid
