#include "daemon/service/open_publisher.hpp"

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "daemon/base/log.hpp"
#include "daemon/sockets/listening_socket.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "protocol/json_value.hpp"
#include "protocol/status_json.hpp"

namespace splid {
namespace {

// A splid that has just started, or whose machine is busy, answers late; who is none costs all of
// it.
constexpr std::chrono::seconds patience{3};

std::string text_in(const std::string& json, const char* member) {
  const auto message = json_value_if_any(json);
  if (!message.is_object() || !message.contains(member) || !message[member].is_string()) return {};
  return message[member].get<std::string>();
}

// "splid 1.2.3, which measures from the simulator with the pattern interleaved-180-189". A splid
// says so to each new subscriber. Empty where the publisher wants keys, or is another program.
std::string who_publishes_at(std::string endpoint) {
  if (const auto star = endpoint.find('*'); star != std::string::npos) {
    endpoint.replace(star, 1, "127.0.0.1");
  }
  const auto until = std::chrono::steady_clock::now() + patience;
  std::string version;
  std::string status;
  try {
    sockets::Subscriber subscriber(endpoint, {topic_version, topic_status});
    while ((version.empty() || status.empty()) && std::chrono::steady_clock::now() < until) {
      const auto message = subscriber.receive(std::chrono::milliseconds{100});
      if (!message) continue;
      (message->topic == topic_version ? version : status) = message->json;
    }
  } catch (const Error&) {
    return {};
  }
  const std::string release = text_in(version, "release");
  if (release.empty()) return {};
  std::string who = "splid " + release;
  const std::string source = text_in(status, "source");
  const std::string pattern = text_in(version, "pattern");
  if (!source.empty()) who += ", which measures from " + source;
  if (!pattern.empty()) who += (source.empty() ? ", " : " ") + ("with the pattern " + pattern);
  return who;
}

std::string other_endpoint(const Config& config, const SessionOptions& options) {
  if (!options.other_endpoint.empty()) return options.other_endpoint;
  return "give " + config.file + " an endpoint of its own, such as tcp://127.0.0.1:9882" +
         (options.is_service ? "" : ", or replay with --no-publish");
}

std::string taken(const sockets::EndpointTaken& error) {
  const std::string who = who_publishes_at(error.endpoint());
  return error.place() + ", by " +
         (who.empty() ? "another program, or a splid that asks for keys" : who);
}

}  // namespace

std::unique_ptr<Publisher> open_publisher(const Config& config, const SessionOptions& options,
                                          security::Authenticator* authenticator,
                                          security::Refusals& refusals) {
  const auto unbound = [&] { return std::make_unique<Publisher>("", options.queue_messages); };
  if (!options.publish) return unbound();
  const Publisher::Access access{config.publish.local_endpoint, authenticator, &refusals};
  try {
    return std::make_unique<Publisher>(config.publish.endpoint, options.queue_messages, access);
  } catch (const sockets::EndpointTaken& error) {
    if (options.may_only_print) {
      log_warning("{}; frames are {} and not published", taken(error),
                  options.json ? "printed" : "written");
      return unbound();
    }
    throw Error(Fault::device, taken(error) +
                                   "; stop that program (the service: systemctl stop splid), or " +
                                   other_endpoint(config, options));
  }
}

}  // namespace splid
