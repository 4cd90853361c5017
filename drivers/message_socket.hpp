#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace splid {

// The client's end of a connection that carries whole messages. drivers/ knows no ZeroMQ: whoever
// opens a driver that needs such connections brings them.
//
// Threads: one. Errors: none: a connection is made and made anew in the background, and messages
// that nobody takes are not answered.
class MessageSocket {
 public:
  virtual ~MessageSocket() = default;
  virtual void send(const std::string& message) = 0;
  // The next message; absent where none came within `patience`.
  virtual std::optional<std::string> receive(std::chrono::milliseconds patience) = 0;
};

enum class SocketKind { request, pair };

// place: HOST:PORT.
using OpenSocket =
    std::function<std::unique_ptr<MessageSocket>(SocketKind kind, const std::string& place)>;

}  // namespace splid
