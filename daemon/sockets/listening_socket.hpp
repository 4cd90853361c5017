#pragma once

#include <string>
#include <utility>

#include "daemon/base/file_descriptor.hpp"
#include "protocol/error.hpp"

namespace splid {

// Another program has the endpoint.
class EndpointTaken : public Error {
 public:
  // place: the key, the endpoint and what the kernel said; advice: the rest of the sentence.
  EndpointTaken(std::string endpoint, std::string place, const std::string& advice)
      : Error(Fault::device, place + advice),
        endpoint_(std::move(endpoint)),
        place_(std::move(place)) {}
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  [[nodiscard]] const std::string& place() const { return place_; }

 private:
  std::string endpoint_;
  std::string place_;
};

// A socket that listens where an endpoint of the configuration says: tcp://HOST:PORT (HOST an IPv4
// address, an IPv6 one in brackets, which takes IPv4 too, an interface's name, localhost or *, for
// all of IPv4; PORT * for the system's choice) or ipc://PATH, whose file a dead process may have
// left and whose mode is the process's umask's. PATH with @ before it has no file.
//
// Threads: one. Errors: the constructor throws Error naming the key: Fault::usage for an endpoint
// that is none, Fault::device for one that cannot be bound now, as
// EndpointTaken where another has it.
class ListeningSocket {
 public:
  // key: of the configuration, that names the endpoint.
  ListeningSocket(const std::string& key, const std::string& endpoint)
      : ListeningSocket(key, endpoint, endpoint) {}
  // given: what it is there, if not the endpoint.
  ListeningSocket(const std::string& key, const std::string& endpoint, const std::string& given);
  // One that listens already. endpoint: what to call it.
  ListeningSocket(int socket, std::string endpoint)
      : socket_(socket), endpoint_(std::move(endpoint)) {}
  ~ListeningSocket() { close(); }
  ListeningSocket(ListeningSocket&&) = default;
  ListeningSocket& operator=(ListeningSocket&&) = delete;
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  [[nodiscard]] int get() const { return socket_.get(); }
  [[nodiscard]] bool is_open() const { return socket_.is_open(); }
  // As bound: a wildcard port is resolved.
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  // Takes no more connections; removes the file that it made.
  void close();

 private:
  void bind_tcp(const std::string& address);
  void bind_ipc(const std::string& path);

  FileDescriptor socket_;
  std::string endpoint_;
  std::string file_;  // made by this; empty: none
};

}  // namespace splid
