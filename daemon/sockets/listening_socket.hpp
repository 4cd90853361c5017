#pragma once

#include <string>
#include <utility>

#include "daemon/base/file_descriptor.hpp"
#include "protocol/error.hpp"

namespace splid::sockets {

// The error where another program already listens at the endpoint.
class EndpointTaken : public Error {
 public:
  // place: the beginning of the sentence, with the key, the endpoint and the kernel's error;
  // advice: the rest of the sentence.
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

// A socket that listens at a configured endpoint.
//
// tcp://HOST:PORT: HOST is an IPv4 address, an IPv6 address in brackets (which accepts IPv4 too),
// the name of an interface, localhost, or * for all IPv4 addresses. PORT * lets the system choose.
// ipc://PATH: a Unix socket, whose file gets its mode from the process's umask. A file that a dead
// process left there is replaced. A PATH that begins with @ is an abstract name, without a file.
//
// Threads: one. Errors: the constructor throws Error, which names the key: Fault::usage for a
// malformed endpoint, Fault::device for an endpoint that cannot be bound at present, as
// EndpointTaken where another program has it.
class ListeningSocket {
 public:
  // key: the configuration key that the endpoint comes from.
  ListeningSocket(const std::string& key, const std::string& endpoint)
      : ListeningSocket(key, endpoint, endpoint) {}
  // given: the key's value, where that is not the endpoint itself.
  ListeningSocket(const std::string& key, const std::string& endpoint, const std::string& given);
  // Takes over a socket that listens already. endpoint: the name for it.
  ListeningSocket(int socket, std::string endpoint)
      : socket_(socket), endpoint_(std::move(endpoint)) {}
  ~ListeningSocket() { close(); }
  ListeningSocket(ListeningSocket&&) = default;
  ListeningSocket& operator=(ListeningSocket&&) = delete;
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  [[nodiscard]] int get() const { return socket_.get(); }
  [[nodiscard]] bool is_open() const { return socket_.is_open(); }
  // The endpoint as bound, with the port that the system chose for *.
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  // Stops listening and removes the socket's file, if this made one.
  void close();

 private:
  void bind_tcp(const std::string& address);
  void bind_ipc(const std::string& path);

  FileDescriptor socket_;
  std::string endpoint_;
  std::string file_;  // the socket's file, made by this; empty: none
};

}  // namespace splid::sockets
