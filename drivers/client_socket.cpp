#include "drivers/client_socket.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>

#include "protocol/error.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

constexpr std::string_view unix_prefix = "unix:";
constexpr std::string_view tcp_prefix = "tcp:";

// How long a look at a socket may last, since the stop token is looked at in between.
constexpr milliseconds connect_slice{20};

bool is_port(std::string_view text) {
  unsigned port = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  return error == std::errc{} && stop == end && port >= 1 && port <= 65'535;
}

bool wait_for(int descriptor, short events, milliseconds patience) {
  pollfd entry{descriptor, events, 0};
  return ::poll(&entry, 1, static_cast<int>(patience.count())) > 0;
}

void set_socket_option(int descriptor, int level, int option, int value) {
  ::setsockopt(descriptor, level, option, &value, sizeof value);
}

}  // namespace

std::optional<std::string> socket_address_fault(const std::string& text) {
  if (text.starts_with(unix_prefix)) {
    const std::size_t bytes = text.size() - unix_prefix.size();
    if (bytes == 0) return "names no file; write unix:/run/splid/bridge.sock";
    if (bytes < sizeof sockaddr_un::sun_path) return std::nullopt;
    return "has a path of " + std::to_string(bytes) + " bytes; a socket's may have 107";
  }
  if (!text.starts_with(tcp_prefix)) return "must begin with unix: or tcp:";
  const std::size_t colon = text.rfind(':');
  if (colon <= tcp_prefix.size() || !is_port(std::string_view(text).substr(colon + 1))) {
    return "is not a host and port; write tcp:HOST:PORT, such as tcp:192.168.1.20:9880";
  }
  if (text[tcp_prefix.size()] == '/') {
    return "has slashes, which a bridge's address has not; write tcp:" +
           text.substr(std::min(text.find_first_not_of('/', tcp_prefix.size()), text.size()));
  }
  return std::nullopt;
}

ClientSocket::ClientSocket(std::string address) : address_(std::move(address)) {
  if (const auto fault = socket_address_fault(address_)) {
    throw Error(Fault::usage, "\"" + address_ + "\" " + *fault);
  }
  if (address_.starts_with(unix_prefix)) {
    sockaddr_un place{};
    place.sun_family = AF_UNIX;
    std::copy(address_.begin() + unix_prefix.size(), address_.end(), place.sun_path);
    std::memcpy(&place_, &place, sizeof place);
    place_bytes_ = sizeof place;
    return;
  }
  const std::size_t colon = address_.rfind(':');
  const std::string host = address_.substr(tcp_prefix.size(), colon - tcp_prefix.size());
  addrinfo hints{};
  // The service unit allows IPv4 only, and a bridge at 0.0.0.0 does not hear localhost's ::1.
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int failed = ::getaddrinfo(host.c_str(), address_.c_str() + colon + 1, &hints, &found);
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> list(found, ::freeaddrinfo);
  if (failed != 0) {
    throw Error(Fault::device, "\"" + address_ + "\": the host " + host + " is not known: " +
                                   ::gai_strerror(failed) + "; give its address in numbers");
  }
  std::memcpy(&place_, list->ai_addr, list->ai_addrlen);
  place_bytes_ = list->ai_addrlen;
}

bool ClientSocket::fail(const char* call, int error) {
  end(std::string(call) + ": " + std::strerror(error));
  return false;
}

bool ClientSocket::connect(const std::stop_token& stop) {
  close();
  descriptor_ = ::socket(place_.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor_ == -1) return fail("socket", errno);
  if (place_.ss_family != AF_UNIX) {
    // A short command would wait up to 200 ms for the acknowledgement of the command before.
    set_socket_option(descriptor_, IPPROTO_TCP, TCP_NODELAY, 1);
    // A machine that lost its power does not close its connections: 6 s after its last byte the
    // connection fails.
    set_socket_option(descriptor_, SOL_SOCKET, SO_KEEPALIVE, 1);
    set_socket_option(descriptor_, IPPROTO_TCP, TCP_KEEPIDLE, 3);
    set_socket_option(descriptor_, IPPROTO_TCP, TCP_KEEPINTVL, 1);
    set_socket_option(descriptor_, IPPROTO_TCP, TCP_KEEPCNT, 3);
  }
  if (::connect(descriptor_, reinterpret_cast<const sockaddr*>(&place_), place_bytes_) == 0) {
    return true;
  }
  // EAGAIN: a Unix socket whose queue of callers is full.
  return errno == EINPROGRESS ? wait_connected(stop) : fail("connect", errno);
}

bool ClientSocket::wait_connected(const std::stop_token& stop) {
  for (auto left = connect_patience; left > left.zero() && !stop.stop_requested();
       left -= connect_slice) {
    if (!wait_for(descriptor_, POLLOUT, connect_slice)) continue;
    int error = 0;
    socklen_t bytes = sizeof error;
    ::getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &bytes);
    return error == 0 || fail("connect", error);
  }
  return fail("connect", ETIMEDOUT);
}

std::size_t ClientSocket::read(std::span<std::byte> room, milliseconds patience) {
  if (!wait_for(descriptor_, POLLIN, patience)) return 0;
  const ssize_t got = ::recv(descriptor_, room.data(), room.size(), 0);
  if (got > 0) return static_cast<std::size_t>(got);
  if (got == 0) {
    end("the other side closed the connection");
  } else if (errno != EAGAIN && errno != EINTR) {
    fail("recv", errno);
  }
  return 0;
}

std::size_t ClientSocket::write(std::string_view bytes, milliseconds patience) {
  if (!wait_for(descriptor_, POLLOUT, patience)) return 0;
  const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent >= 0) return static_cast<std::size_t>(sent);
  if (errno == EPIPE) {
    end("the other side closed the connection");
  } else if (errno != EAGAIN && errno != EINTR) {
    fail("send", errno);
  }
  return 0;
}

void ClientSocket::end(const std::string& why) {
  failure_ = address_ + ": " + why;
  close();
}

void ClientSocket::close() {
  if (descriptor_ != -1) ::close(std::exchange(descriptor_, -1));
}

}  // namespace splid
