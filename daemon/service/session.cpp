#include "daemon/service/session.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/base/line_writer.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/recording/frame_log.hpp"
#include "daemon/security/server_security.hpp"
#include "daemon/service/control/control_endpoint.hpp"
#include "daemon/service/control/control_server.hpp"
#include "daemon/service/control_actions.hpp"
#include "daemon/service/found_values.hpp"
#include "daemon/service/measuring.hpp"
#include "daemon/service/open_publisher.hpp"
#include "daemon/service/reloader.hpp"
#include "daemon/service/session_report.hpp"
#include "daemon/stream/scan_check.hpp"
#include "daemon/study/truth_score.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

void wait_for_subscriber(Publisher& publisher, double seconds, const std::stop_token& stop) {
  if (seconds <= 0 || publisher.endpoint().empty()) return;
  constexpr double slice_s = 0.1;
  for (double left_s = seconds; left_s > 0 && !stop.stop_requested(); left_s -= slice_s) {
    if (publisher.wait_for_subscriber(std::chrono::milliseconds{100})) return;
  }
  if (!stop.stop_requested()) log_warning("nobody subscribed within {} s; going on", seconds);
}

std::string where(const Publisher& publisher, const security::Authenticator* authenticator) {
  if (publisher.endpoint().empty()) return "not publishing";
  std::string text = "publishing at " + publisher.endpoint();
  if (authenticator != nullptr) text += " (CURVE, public key " + authenticator->public_key() + ")";
  const std::string& local = publisher.local_endpoint();
  return local.empty() ? text : text + " and, for this machine, at " + local;
}

// Null where the configuration asks for no metrics.
std::unique_ptr<Metrics> open_metrics(const Config& config, const TagSource& source,
                                      DeviceMonitor& device, const Publisher& publisher,
                                      security::Refusals& refusals) {
  if (config.metrics.file.empty() && config.metrics.http.empty()) return nullptr;
  auto metrics = std::make_unique<Metrics>(
      config.metrics, status_options(config), source.counters(), host_clock(),
      [&device](const std::string& sentence) {
        log_warning(sentence);
        device.notice(sentence);
      },
      &refusals);
  metrics->count_dropped([&publisher] { return publisher.dropped(); });
  if (!metrics->url().empty()) log_info("metrics at {}", metrics->url());
  return metrics;
}

// With their domains. A reload reads both before it changes anything.
using AllowLists = std::vector<std::pair<std::string, security::AllowList>>;

AllowLists read_allow_lists(const Config& next) {
  AllowLists lists;
  const auto read = [&](const char* domain, const std::string& file) {
    if (!file.empty()) lists.emplace_back(domain, security::AllowList::read(file));
  };
  read(security::publish_domain, next.security.allow_list);
  read(security::control_domain, next.control.allow_list);
  return lists;
}

std::string change_allow_lists(security::Authenticator& authenticator, AllowLists lists) {
  std::string all;
  for (auto& [domain, list] : lists) {
    const std::string what = security::change_allow_list(authenticator, domain, std::move(list));
    if (!what.empty()) all += (all.empty() ? "" : "; ") + what;
  }
  return all;
}

// Null where there is no control endpoint. The daemon can do without an endpoint that the
// configuration does not name.
std::unique_ptr<control::Server> open_control(const Config& config, ControlActions& actions,
                                              security::Authenticator* authenticator,
                                              security::Refusals& refusals) {
  const std::string endpoint = control::endpoint_of(config.control);
  if (endpoint.empty()) return nullptr;
  const bool is_protected = config.control.is_tcp();
  if (is_protected) {
    authenticator->allow(security::control_domain,
                         security::AllowList::read(config.control.allow_list));
  }
  control::Handlers handlers;
  handlers.status = [&actions](const std::string& doing) { return actions.status(doing); };
  handlers.perform = [&actions](const control::Request& request, const std::stop_token& stop) {
    return actions.perform(request, stop);
  };
  try {
    auto server = std::make_unique<control::Server>(
        endpoint, std::move(handlers), is_protected ? authenticator : nullptr, refusals);
    log_info("control at {}", server->endpoint());
    return server;
  } catch (const Error& error) {
    if (config.control.endpoint == endpoint) throw;
    log_warning("no control: {}", error.what());
    return nullptr;
  }
}

void keep(const FrameMessage& message, recording::FrameLog& frames) {
  frames.put(message);
  if (const std::string fault = frames.fault(); !fault.empty()) throw Error(Fault::device, fault);
}

// Sums of what is too frequent for a line in the log each time.
void say_who_came(const security::Refusals& refusals, const Publisher& publisher) {
  if (refusals.kept_out() > 0) {
    log_info("{} connections refused", grouped(refusals.kept_out()));
  }
  if (refusals.let_go() > 0) {
    log_info("{} connections let go that were too many or sent too much",
             grouped(refusals.let_go()));
  }
  if (publisher.dropped() > 0) {
    log_warning("{} messages were not sent in time to anybody", grouped(publisher.dropped()));
  }
}

// What the run showed of configuration and data. A stop that was asked for may come before there
// was enough to judge by: the fault is a warning then.
void judge(const StreamSummary& summary, const Config& config, bool was_stopped) {
  check_cost(summary, static_cast<double>(config.pipeline.estimation_threads));
  try {
    check_scan(summary.tags);
    check_locked(summary);
    check_pattern(summary);
  } catch (const Error& error) {
    if (!was_stopped) throw;
    log_warning(error.what());
  }
}

}  // namespace

int run_session(const Config& config, std::unique_ptr<TagSource> source, DeviceMonitor& device,
                const SessionOptions& options, const std::stop_token& stop) {
  const auto warn = [](const std::string& sentence) { log_warning(sentence); };
  security::Refusals refusals(warn, host_clock());
  const auto authenticator = security::open_authenticator(config.security, warn, refusals);
  const std::unique_ptr<Publisher> opened =
      open_publisher(config, options, authenticator.get(), refusals);
  Publisher& publisher = *opened;
  const std::unique_ptr<Metrics> metrics =
      open_metrics(config, *source, device, publisher, refusals);
  LineWriter out(stdout, "standard output");
  Progress progress(host_clock());
  EncoderScore encoder;
  FoundValues found;
  FoundPixels found_pixels;
  const bool has_pixels = config.pixels.size() > 1;
  const auto pixel_observer = [&](const SceneMessage::Pixel& pixel) {
    if (!options.is_service) found_pixels.take(pixel);
    if (options.frames != nullptr) keep(pixel.frame, *options.frames);
  };
  const auto observer = [&](const FrameMessage& message, const std::string& json) {
    encoder.take(message);
    if (!options.is_service) found.take(message);
    if (progress.due()) progress.show(in_words(message));
    if (options.frames != nullptr && !has_pixels) keep(message, *options.frames);
    return !options.json || out.write(json);
  };
  Output output(output_options(config),
                {publisher, &device, metrics.get(), observer, pixel_observer}, host_clock());
  Measuring measuring(config, output, device, options.is_service);
  const auto apply = [&](const std::shared_ptr<const Config>& next, bool is_new) {
    AllowLists lists = authenticator ? read_allow_lists(*next) : AllowLists{};
    if (is_new) measuring.reload(*next, stop);
    return authenticator ? change_allow_lists(*authenticator, std::move(lists)) : "";
  };
  const Reloader reloader(config, device, options.signals, apply);
  ControlActions actions(config, measuring, publisher);
  const auto control =
      options.is_service ? open_control(config, actions, authenticator.get(), refusals) : nullptr;
  log_info("source {}; pattern {} ({}); {}", source->info().name, config.pattern_file,
           describe_pattern(config.pattern), where(publisher, authenticator.get()));
  wait_for_subscriber(publisher, options.wait_for_subscriber_s, stop);
  const StreamSummary summary = measuring.run(std::move(source), stop);
  progress.clear();
  if (!options.is_service && summary.frames > 0) {
    log_info(has_pixels ? found_pixels.in_words() : found.in_words());
  }
  if (encoder.compared() > 0) log_info(encoder.summary());
  say_who_came(refusals, publisher);
  if (summary.fault) std::rethrow_exception(summary.fault);
  if (!summary.paused) judge(summary, config, stop.stop_requested());
  return 0;
}

}  // namespace splid
