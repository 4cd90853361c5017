#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "protocol/error.hpp"

namespace splid {

class Authenticator;

// Another program has the endpoint; open_publisher() says what to do.
class EndpointTaken : public Error {
 public:
  EndpointTaken(std::string endpoint, const std::string& what)
      : Error(Fault::device, what), endpoint_(std::move(endpoint)) {}
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }

 private:
  std::string endpoint_;
};

// The ZeroMQ socket that subscribers connect to: XPUB, bound, each message exactly two parts, topic
// and JSON (protocol/messages.hpp). It may have a second endpoint, plain, at which the same
// messages come. Subscribers are never waited for: one that does not read loses messages beyond its
// own queue, and costs the others nothing.
//
// Threads: one at a time; a hand-over needs a fence between, such as the start of a thread.
// Errors: the constructor throws Error, Fault::usage for an endpoint that ZeroMQ cannot read and
// Fault::device for one that cannot be bound, as EndpointTaken where another program has it;
// nothing after that. Timeouts: no call waits but wait_for_subscriber(); the destructor waits up to
// linger for what is still queued.
class Publisher {
 public:
  static constexpr std::chrono::milliseconds linger{300};

  // Who may connect besides those whom `endpoint` alone lets in.
  struct Access {
    std::string local_endpoint;              // plain; empty: none
    Authenticator* authenticator = nullptr;  // of `endpoint`, outlives this; null: it is plain too
  };

  // endpoint: empty: bound nowhere, so that nobody can subscribe and every message is dropped.
  // queue_messages: how many messages are kept for each subscriber that does not read.
  Publisher(const std::string& endpoint, int queue_messages, const Access& access);
  // Plain.
  Publisher(const std::string& endpoint, int queue_messages);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  // As bound: a wildcard port is resolved. The local one is empty where there is none.
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  [[nodiscard]] const std::string& local_endpoint() const { return local_endpoint_; }

  void publish_frame(const std::string& json);
  // The last of each is kept and sent to every new subscriber.
  void publish_status(const std::string& json);
  void publish_version(const std::string& json);
  // What publish_status() was last given. Any thread.
  [[nodiscard]] std::string last_status() const;

  // Sends what is kept to those who subscribed since the last call. ZeroMQ addresses all
  // subscribers of a topic or none: the others see the same message, with the same sequence, again.
  void greet();

  // Greets until somebody has subscribed to frames or the time is over; says whether.
  bool wait_for_subscriber(std::chrono::milliseconds timeout);

 private:
  struct Socket;
  void send(const char* topic, const std::string& json);

  std::unique_ptr<Socket> socket_;
  std::string endpoint_;
  std::string local_endpoint_;
  std::string version_;
  mutable std::mutex status_mutex_;
  std::string status_;  // written under the mutex
};

}  // namespace splid
