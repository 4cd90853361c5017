#include "daemon/forward/forwarding.hpp"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "protocol/json_value.hpp"

namespace splid::forward {
namespace {

using Milliseconds = std::chrono::milliseconds;

constexpr Milliseconds idle{100};
constexpr Milliseconds before_next_try{250};
constexpr std::int64_t between_reports_ns = 10'000'000'000;
constexpr std::chrono::seconds last_patience{2};

// ZeroMQ's own queue, for the moments in which this process does not run.
constexpr int most_waiting = 10'000;

}  // namespace

Forwarding::Forwarding(Options options)
    : options_(std::move(options)),
      subscriber_(options_.endpoint, options_.topics, options_.client, most_waiting),
      backlog_(options_.to.device, options_.most_bytes),
      broker_(options_.to.is_nats ? open_nats(options_.to) : open_mqtt(options_.to)) {}

void Forwarding::run(const std::stop_token& stop) {
  std::jthread carrier([this](const std::stop_token& own_stop) { carry(own_stop); });
  take_messages(stop);
  report("stopped");
  carrier.request_stop();
  carrier.join();
}

// Somebody else's subscription to frame/NAME brings its messages here too: ZeroMQ knows prefixes.
void Forwarding::take_messages(const std::stop_token& stop) {
  std::int64_t reported_ns = host_clock().steady_ns();
  bool was_connected = false;
  bool has_told = false;
  while (!stop.stop_requested()) {
    const std::int64_t now_ns = host_clock().steady_ns();
    const bool is_connected = is_connected_;
    if (now_ns - reported_ns > between_reports_ns || (is_connected && !was_connected)) {
      report("running");
      reported_ns = now_ns;
    }
    was_connected = is_connected;
    const auto heard = subscriber_.receive(idle);
    look_at_daemon();
    const auto& topics = options_.topics;
    if (!heard || std::find(topics.begin(), topics.end(), heard->topic) == topics.end()) continue;
    auto message = make_message(options_.to.device, heard->topic, heard->json);
    if (message) {
      backlog_.add(std::move(*message));
    } else if (!std::exchange(has_told, true)) {
      log_warning("a message without sequence and timestamp is left out: {}", heard->json);
    }
  }
}

void Forwarding::carry(const std::stop_token& stop) {
  std::vector<Message> batch;
  std::optional<std::chrono::steady_clock::time_point> end;
  for (;;) {
    if (batch.empty()) batch = backlog_.take(idle);
    if (stop.stop_requested() && !end) end = std::chrono::steady_clock::now() + last_patience;
    if (end && (batch.empty() || std::chrono::steady_clock::now() > *end)) return;
    const Broker::Outcome outcome = broker_->carry(batch);
    finish(outcome, batch);
    tell(outcome.fault);
    if (!outcome.fault.empty()) std::this_thread::sleep_for(before_next_try);
  }
}

void Forwarding::finish(const Broker::Outcome& outcome, std::vector<Message>& batch) {
  for (std::size_t i = 0; i < outcome.done; ++i) {
    const bool is_refused =
        std::find(outcome.refused.begin(), outcome.refused.end(), i) != outcome.refused.end();
    if (is_refused) {
      log_warning("{}: {} bytes are more than the broker takes: lost", batch[i].id,
                  batch[i].json.size());
    }
    backlog_.done(batch[i], is_refused);
  }
  batch.erase(batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(outcome.done));
}

// Each turn once.
void Forwarding::tell(const std::string& fault) {
  if (fault.empty()) {
    if (is_connected_) return;
    ++connections_;
    log_info("connected to the broker; {} messages wait", grouped(backlog_.counts().waiting));
  } else if (fault != told_) {
    log_warning("{}; tried again until it answers", fault);
  }
  is_connected_ = fault.empty();
  told_ = fault;
}

void Forwarding::look_at_daemon() {
  using State = security::HandshakeWatch::State;
  const State state = subscriber_.state();
  if (state == said_) return;
  said_ = state;
  if (state == State::pending) return;
  log_info("{}", in_words(state, options_.endpoint, options_.client ? &*options_.client : nullptr));
}

void Forwarding::report(const char* state) {
  const Backlog::Counts counts = backlog_.counts();
  const std::uint64_t connections = connections_;
  const nlohmann::ordered_json json = {{"schema", "splid.forward"},
                                       {"v", {1, 0}},
                                       {"timestamp", host_clock().unix_s()},
                                       {"sequence", reports_++},
                                       {"device", options_.to.device},
                                       {"state", state},
                                       {"carried", counts.carried},
                                       {"waiting", counts.waiting},
                                       {"lost", counts.lost},
                                       {"connections", connections}};
  auto message = make_message(options_.to.device, topic_forward, json_text(json));
  if (message) backlog_.add(std::move(*message));
}

}  // namespace splid::forward
