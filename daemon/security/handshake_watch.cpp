#include "daemon/security/handshake_watch.hpp"

#include <atomic>
#include <cstring>
#include <zmq.hpp>

namespace splid::security {
namespace {

using State = HandshakeWatch::State;

constexpr int watched_events = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                               ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                               ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_DISCONNECTED;

// A new name each time, since the sockets of a context share the names of endpoints.
std::string new_endpoint() {
  static std::atomic<unsigned> count{0};
  return "inproc://splid.monitor." + std::to_string(count++);
}

// An event is a number of 16 bits and then a number of 32 bits, in the machine's byte order.
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

HandshakeWatch::HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket, const Clock& clock)
    : monitor_(context, socket, watched_events), clock_(clock), since_ns_(clock.steady_ns()) {}

State HandshakeWatch::state() {
  while (const auto event = monitor_.next()) take(*event);
  const bool is_open = state_ == State::pending || state_ == State::unanswered;
  if (is_open && clock_.steady_ns() - since_ns_ >= patience_ns) {
    state_ = broken_off_ ? State::broken_off : State::unanswered;
  }
  return state_;
}

void HandshakeWatch::take(const SocketMonitor::Event& event) {
  switch (event.kind) {
    case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
      state_ = State::connected;
      break;
    case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
      state_ = State::refused;
      break;
    // Whichever end sees a fault first ends the handshake, and then the other end gets no reason.
    // The next attempt may tell more, so the state stays pending.
    case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
      broken_off_ = true;
      break;
    case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
      state_ = event.value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH ? State::other_mechanism
                                                                         : State::other_protocol;
      break;
    // Disconnected. This comes after a failed handshake too, whose reason must stay.
    default:
      if (state_ != State::connected) break;
      state_ = State::pending;
      broken_off_ = false;
      since_ns_ = clock_.steady_ns();
  }
}

std::string in_words(State state, const std::string& endpoint, const CurveClient* client) {
  switch (state) {
    case State::pending:
      return "connecting to " + endpoint;
    case State::connected:
      return "connected to " + endpoint;
    case State::unanswered:
      return "nothing answers at " + endpoint +
             "; does a splid run there that has this as its publish.endpoint?";
    case State::refused:
      return endpoint +
             " refuses this key; add it to the allow-list there (security.allow_list) and "
             "reload that splid: " +
             (client == nullptr ? "" : client->own.public_key) + " NAME";
    case State::other_mechanism:
      return client == nullptr
                 ? endpoint + " lets in only those who have a key; give --key and --server-key"
                 : endpoint +
                       " speaks no CURVE; leave out --key and --server-key, or give an endpoint "
                       "with CURVE";
    case State::broken_off:
    case State::other_protocol:
      break;
  }
  return endpoint + " breaks off the handshake; " +
         (client == nullptr ? "is a splid there, and does it ask for --key and --server-key?"
                            : "is --server-key the key of that server, and is a splid there?");
}

}  // namespace splid::security
