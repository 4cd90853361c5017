#pragma once

#include <sys/socket.h>

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

namespace splid {

// Where an instrument or a bridge listens: "unix:PATH" or "tcp:HOST:PORT", IPv4.
//
// Null where `text` is such an address; otherwise what is wrong with it, to go behind the address
// in a sentence.
std::optional<std::string> socket_address_fault(const std::string& text);

// The client's end of a byte stream to a bridge or an instrument, on this machine or another.
//
// Threads: one. Errors: none after construction; a failure is a sentence.
class ClientSocket {
 public:
  static constexpr std::chrono::milliseconds connect_patience{1000};

  // Looks the host's name up, once. Errors: Error(Fault::usage) where the address is none,
  // Error(Fault::device) where nobody knows the host.
  explicit ClientSocket(std::string address);
  ~ClientSocket() { close(); }
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] bool is_open() const { return descriptor_ != -1; }
  // Address and reason, of the connection that could not be made or ended last.
  [[nodiscard]] const std::string& failure() const { return failure_; }

  // Tries once, for connect_patience at most, and returns within some 20 ms of a stop request.
  bool connect(const std::stop_token& stop);
  // What has come, within `patience`; 0 where nothing did, or the other side or a failure closed
  // the connection, which is_open() then tells.
  std::size_t read(std::span<std::byte> room, std::chrono::milliseconds patience);
  // Of `bytes` as many as go out within `patience`; 0 as of read().
  std::size_t write(std::string_view bytes, std::chrono::milliseconds patience);
  // Closes it; why: for failure().
  void end(const std::string& why);
  void close();

 private:
  bool fail(const char* call, int error);
  bool wait_connected(const std::stop_token& stop);

  std::string address_;
  sockaddr_storage place_{};
  socklen_t place_bytes_ = 0;
  int descriptor_ = -1;
  std::string failure_;
};

}  // namespace splid
