#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace splid {

// The other end of a Publisher, for `listen`.
//
// Threads: one. Errors: the constructor throws Error(Fault::usage) for an endpoint that ZeroMQ
// cannot read. Connecting itself never fails: it is tried again until somebody is there.
class Subscriber {
 public:
  struct Message {
    std::string topic;
    std::string json;
  };

  Subscriber(const std::string& endpoint, const std::vector<std::string>& topics);
  ~Subscriber();
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  // The next message; absent when none came within the time. Anything but two parts is passed over.
  std::optional<Message> receive(std::chrono::milliseconds timeout);

 private:
  struct Socket;
  std::unique_ptr<Socket> socket_;
};

}  // namespace splid
