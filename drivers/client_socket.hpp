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

// An instrument or a bridge listens at "unix:PATH" or "tcp:HOST:PORT" (IPv4).
//
// Returns nothing where `text` is such an address; otherwise what is wrong with it, in words that
// follow the address in a sentence.
std::optional<std::string> socket_address_fault(const std::string& text);

// The client's end of a byte stream to a bridge or an instrument, on this machine or another.
//
// Threads: one. Errors: none after construction; a failure is a sentence.
class ClientSocket {
 public:
  static constexpr std::chrono::milliseconds connect_patience{1000};

  // Looks the host's name up, once. Errors: Error(Fault::usage) where `address` is no address,
  // Error(Fault::device) where the host's name is not known.
  explicit ClientSocket(std::string address);
  ~ClientSocket() { close(); }
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] bool is_open() const { return descriptor_ != -1; }
  // Address and reason of the last connection that could not be made, or that ended.
  [[nodiscard]] const std::string& failure() const { return failure_; }

  // Tries once, for connect_patience at most, and returns within some 20 ms of a stop request.
  bool connect(const std::stop_token& stop);
  // Reads what comes within `patience`, and returns how many bytes came. 0 where none came, and
  // where the other side or a failure closed the connection: is_open() tells the two apart.
  std::size_t read(std::span<std::byte> room, std::chrono::milliseconds patience);
  // Writes as many of `bytes` as go out within `patience`, and returns how many. 0: as of read().
  std::size_t write(std::string_view bytes, std::chrono::milliseconds patience);
  // Closes the connection; why: the reason that failure() then gives.
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
