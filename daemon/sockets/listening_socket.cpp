#include "daemon/sockets/listening_socket.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include "config/endpoint.hpp"
#include "protocol/error.hpp"

namespace splid::sockets {
namespace {

constexpr int backlog = 128;
constexpr std::string_view tcp = "tcp://";
constexpr std::string_view ipc = "ipc://";

// The error of a system call; bind_error() makes the sentence.
[[noreturn]] void fail(int error = errno) {
  throw std::system_error(error, std::generic_category());
}

[[noreturn]] void throw_bind_error(const std::string& key, const std::string& given, int error) {
  const std::string place = key + " " + given + ": " + std::generic_category().message(error);
  if (error == EADDRINUSE) {
    throw EndpointTaken(given, place,
                        "; another program, maybe another splid, listens there: stop it or give " +
                            key + (given.starts_with(ipc) ? " another file" : " another port"));
  }
  throw Error(Fault::device,
              place + "; give " + key + " an address of this machine that may be bound");
}

FileDescriptor new_socket(int family) {
  FileDescriptor socket(::socket(family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) fail();
  return socket;
}

void bind_and_listen(int socket, const void* address, socklen_t size) {
  if (::bind(socket, static_cast<const sockaddr*>(address), size) != 0) fail();
  if (::listen(socket, backlog) != 0) fail();
}

std::optional<in_addr> address_of_interface(const std::string& name) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return std::nullopt;
  std::optional<in_addr> found;
  for (const ifaddrs* one = all; one != nullptr && !found; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if (name == one->ifa_name)
      found = reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr;
  }
  ::freeifaddrs(all);
  return found;
}

in_addr ipv4_of(const std::string& host) {
  in_addr address{};
  if (host == "*") return address;
  if (inet_pton(AF_INET, host == "localhost" ? "127.0.0.1" : host.c_str(), &address) == 1) {
    return address;
  }
  const auto of_interface = address_of_interface(host);
  if (!of_interface) fail(ENODEV);
  return *of_interface;
}

std::uint16_t port_of(const std::string& text) {
  std::uint16_t port = 0;  // 0: the system chooses
  std::from_chars(text.data(), text.data() + text.size(), port);
  return port;
}

std::string place_of(int socket) {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&storage), &size) != 0) fail();
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (storage.ss_family == AF_INET6) {
    const auto& place = reinterpret_cast<const sockaddr_in6&>(storage);
    inet_ntop(AF_INET6, &place.sin6_addr, text.data(), text.size());
    return std::string("tcp://[") + text.data() + "]:" + std::to_string(ntohs(place.sin6_port));
  }
  const auto& place = reinterpret_cast<const sockaddr_in&>(storage);
  inet_ntop(AF_INET, &place.sin_addr, text.data(), text.size());
  return std::string("tcp://") + text.data() + ":" + std::to_string(ntohs(place.sin_port));
}

// Whether a socket's file was left by a process that no longer listens.
void make_way(const sockaddr_un& address, socklen_t size) {
  struct stat found {};
  if (::lstat(address.sun_path, &found) != 0) return;
  if (!S_ISSOCK(found.st_mode)) fail(EADDRINUSE);
  const FileDescriptor probe = new_socket(AF_UNIX);
  const int result = ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), size);
  // Where a process listens and its backlog is full, connect() says EAGAIN. It says ECONNREFUSED
  // only where no process has the socket open.
  if (result == 0 || errno != ECONNREFUSED) fail(EADDRINUSE);
  if (::unlink(address.sun_path) != 0) fail();
}

}  // namespace

ListeningSocket::ListeningSocket(const std::string& key, const std::string& endpoint,
                                 const std::string& given) {
  if (const auto fault = endpoint_fault(endpoint)) {
    throw Error(Fault::usage, key + " " + given + ": " + *fault);
  }
  try {
    if (endpoint.starts_with(tcp)) {
      bind_tcp(endpoint.substr(tcp.size()));
    } else {
      bind_ipc(endpoint.substr(ipc.size()));
      endpoint_ = endpoint;
    }
  } catch (const std::system_error& error) {
    throw_bind_error(key, given, error.code().value());
  }
}

void ListeningSocket::close() {
  if (!socket_.is_open()) return;
  if (!file_.empty()) ::unlink(file_.c_str());
  socket_.reset();
}

void ListeningSocket::bind_tcp(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  const std::string host = address.substr(0, colon);
  const std::uint16_t port = htons(port_of(address.substr(colon + 1)));
  const bool is_ipv6 = host.starts_with('[') && host.ends_with(']');
  socket_ = new_socket(is_ipv6 ? AF_INET6 : AF_INET);
  const int yes = 1;
  ::setsockopt(socket_.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (is_ipv6) {
    const int no = 0;
    ::setsockopt(socket_.get(), IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof no);
    sockaddr_in6 place{};
    place.sin6_family = AF_INET6;
    place.sin6_port = port;
    const std::string inside = host.substr(1, host.size() - 2);
    if (inside != "*" && inet_pton(AF_INET6, inside.c_str(), &place.sin6_addr) != 1) fail(ENODEV);
    bind_and_listen(socket_.get(), &place, sizeof place);
  } else {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = port;
    place.sin_addr = ipv4_of(host);
    bind_and_listen(socket_.get(), &place, sizeof place);
  }
  endpoint_ = place_of(socket_.get());
}

void ListeningSocket::bind_ipc(const std::string& path) {
  sockaddr_un place{};
  place.sun_family = AF_UNIX;
  const bool has_file = !path.starts_with('@');
  // An abstract name begins with a NUL and has no NUL at its end.
  std::memcpy(place.sun_path, path.data(), path.size());
  if (!has_file) place.sun_path[0] = '\0';
  const auto size =
      static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size() + (has_file ? 1 : 0));
  if (has_file) make_way(place, size);
  socket_ = new_socket(AF_UNIX);
  bind_and_listen(socket_.get(), &place, size);
  if (has_file) file_ = path;
}

}  // namespace splid::sockets
