#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace splid::security {
class Authenticator;
class Refusals;
}  // namespace splid::security

namespace splid {

// What subscribers connect to: XPUB, each message exactly two parts, topic and JSON
// (protocol/frame_json.hpp, protocol/status_json.hpp). It may have a second endpoint, plain, at
// which the same messages come. The last `version` and `status` go to each new subscriber. ZeroMQ
// addresses all subscribers of a topic or none, so that the earlier subscribers see the same
// message, with the same sequence, again.
//
// Nobody who publishes waits for a subscriber, whatever the subscriber sends or does not read: a
// thread of the publisher's own talks to ZeroMQ, and a gate (daemon/sockets/gate.hpp) before each
// endpoint lets through only what a subscriber may have to say. A subscriber that does not read
// loses the messages beyond its own queue, and costs the other subscribers nothing.
//
// Threads: any thread may call. The publisher has a thread `messages`, and a thread `gate` for each
// endpoint. Errors: the constructor throws Error as ListeningSocket's does; no other call throws.
// Timeouts: no call waits but wait_for_subscriber(); the destructor waits up to linger for what is
// still queued.
class Publisher {
 public:
  static constexpr std::chrono::milliseconds linger{300};

  // Who may connect besides those whom `endpoint` alone lets in. All outlive this.
  struct Access {
    std::string local_endpoint;                        // plain; empty: none
    security::Authenticator* authenticator = nullptr;  // of `endpoint`; null: it is plain too
    security::Refusals* refusals = nullptr;            // hears who is let go; null: nobody does
  };

  // endpoint: empty: bound nowhere, so that nobody can subscribe and every message is dropped.
  // queue_messages: how many messages are kept for each subscriber that does not read.
  Publisher(const std::string& endpoint, int queue_messages, const Access& access);
  // Without keys and without a local endpoint.
  Publisher(const std::string& endpoint, int queue_messages);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  // The endpoints as they are bound, a wildcard port resolved. The local endpoint is empty where
  // there is none.
  [[nodiscard]] const std::string& endpoint() const;
  [[nodiscard]] const std::string& local_endpoint() const;

  void publish_frame(std::string json);
  void publish_scene(std::string json);
  void publish_pixel(const std::string& name, std::string json);
  // The last status and the last version are kept for new subscribers.
  void publish_status(std::string json);
  void publish_version(std::string json);
  void publish_fold(std::string json);
  // Whether somebody subscribes to `fold` by its name; who subscribes to everything does not ask
  // for it. Never waits.
  [[nodiscard]] bool fold_is_wanted() const;
  // The topics that begin with `frame/` and that somebody subscribes to by these very words; of
  // these at most most_pixel_topics. Absent where they are the same as at the call that gave
  // `known` its value, which is 0 before the first. Never waits for a subscriber.
  [[nodiscard]] std::optional<std::vector<std::string>> pixel_topics(std::uint64_t& known) const;
  static constexpr std::size_t most_pixel_topics = 4096;
  // What publish_status() was last given.
  [[nodiscard]] std::string last_status() const;

  // How many messages were dropped because the thread that sends did not keep up.
  [[nodiscard]] std::size_t dropped() const;

  // Waits until somebody has subscribed to frames or the time is over; returns whether somebody
  // has.
  bool wait_for_subscriber(std::chrono::milliseconds timeout);

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace splid
