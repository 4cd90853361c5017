#include "daemon/security/socket_monitor.hpp"

#include <atomic>
#include <cstring>
#include <zmq.hpp>

namespace splid {
namespace {

// A name of its own for each: sockets of one context share them.
std::string new_endpoint() {
  static std::atomic<unsigned> count{0};
  return "inproc://splid.monitor." + std::to_string(count++);
}

// A number of 16 bits and one of 32, in the machine's order.
SocketMonitor::Event decode(const zmq::message_t& message) {
  SocketMonitor::Event event;
  std::uint16_t kind = 0;
  if (message.size() != sizeof kind + sizeof event.value) return event;
  const auto* bytes = static_cast<const std::byte*>(message.data());
  std::memcpy(&kind, bytes, sizeof kind);
  std::memcpy(&event.value, bytes + sizeof kind, sizeof event.value);
  event.kind = kind;
  return event;
}

}  // namespace

SocketMonitor::SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, int kinds)
    : socket_(socket), events_(std::make_unique<zmq::socket_t>(context, zmq::socket_type::pair)) {
  const std::string endpoint = new_endpoint();
  if (zmq_socket_monitor(socket.handle(), endpoint.c_str(), kinds) != 0) throw zmq::error_t();
  events_->set(zmq::sockopt::linger, 0);
  events_->connect(endpoint);
}

SocketMonitor::~SocketMonitor() { zmq_socket_monitor(socket_.handle(), nullptr, 0); }

std::optional<SocketMonitor::Event> SocketMonitor::next() {
  zmq::message_t message;
  if (!events_->recv(message, zmq::recv_flags::dontwait)) return std::nullopt;
  Event event = decode(message);
  if (message.more() && events_->recv(message)) event.endpoint = message.to_string();
  return event;
}

}  // namespace splid
