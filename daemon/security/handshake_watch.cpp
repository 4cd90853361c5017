#include "daemon/security/handshake_watch.hpp"

#include <zmq.hpp>

namespace splid {
namespace {

using State = HandshakeWatch::State;

constexpr int watched_events = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                               ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                               ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_DISCONNECTED;

}  // namespace

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
    // Whichever end sees a fault first ends the handshake; the other may say more next time.
    case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
      broken_off_ = true;
      break;
    case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
      state_ = event.value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH ? State::other_mechanism
                                                                         : State::other_protocol;
      break;
    default:  // disconnected: of a failed handshake too, whose reason stays
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
             "; does splid run, with that as its "
             "publish.endpoint?";
    case State::refused:
      return endpoint +
             " refuses this key; add it to the allow-list there (security.allow_list) and "
             "reload that splid: " +
             (client == nullptr ? "" : client->own.public_key) + " NAME";
    case State::other_mechanism:
      return client == nullptr
                 ? endpoint + " lets in only those who have a key; give --key and --server-key"
                 : endpoint +
                       " speaks no CURVE; leave --key and --server-key away, or give the "
                       "endpoint that does";
    case State::broken_off:
    case State::other_protocol:
      break;
  }
  return endpoint + " breaks off the handshake; " +
         (client == nullptr ? "is that splid, and does it ask for --key and --server-key?"
                            : "is --server-key the key of that server, and that splid?");
}

}  // namespace splid
