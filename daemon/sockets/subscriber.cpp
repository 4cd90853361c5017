#include "daemon/sockets/subscriber.hpp"

#include <array>
#include <zmq.hpp>

#include "daemon/sockets/gate_limits.hpp"
#include "protocol/error.hpp"
#include "protocol/scene_json.hpp"

namespace splid::sockets {
namespace {

// What a publisher lets through at once has room for twice as much.
constexpr std::int64_t most_topic_bytes = subscriber_limits.connection.bytes / 2;
constexpr std::int64_t bytes_around = curve_bytes + 12;  // of a topic: encrypted, with two headers

// As the publisher's. A machine that has lost its power or its network closes no connection.
constexpr int heartbeat_interval_ms = 2000;
constexpr int heartbeat_timeout_ms = 6000;

// Without this the kernel asks a machine that is off less and less often, down to once in 64 s.
constexpr int connect_timeout_ms = 5000;

std::vector<std::string> few_enough(std::vector<std::string> topics) {
  std::int64_t bytes = 0;
  for (const std::string& each : topics) {
    bytes += static_cast<std::int64_t>(each.size()) + bytes_around;
  }
  const std::string all_pixels = pixel_topic("");
  const auto is_pixel = [&](const std::string& topic) { return topic.starts_with(all_pixels); };
  if (bytes > most_topic_bytes && std::erase_if(topics, is_pixel) > 0) {
    topics.push_back(all_pixels);
  }
  return topics;
}

}  // namespace

struct Subscriber::Socket {
  zmq::context_t context{1};
  zmq::socket_t sub{context, zmq::socket_type::sub};
  security::HandshakeWatch watch{context, sub, host_clock()};
};

Subscriber::Subscriber(const std::string& endpoint, const std::vector<std::string>& topics,
                       const std::optional<security::CurveClient>& client, int most_waiting)
    : endpoint_(endpoint), socket_(std::make_unique<Socket>()) {
  zmq::socket_t& sub = socket_->sub;
  sub.set(zmq::sockopt::linger, 0);
  // Tries to connect ten times a second, so that a daemon that is just starting is found at once.
  sub.set(zmq::sockopt::reconnect_ivl, 100);
  sub.set(zmq::sockopt::connect_timeout, connect_timeout_ms);
  sub.set(zmq::sockopt::heartbeat_ivl, heartbeat_interval_ms);
  sub.set(zmq::sockopt::heartbeat_timeout, heartbeat_timeout_ms);
  // A replay at full speed sends thousands of messages a second.
  sub.set(zmq::sockopt::rcvhwm, most_waiting);
  sub.set(zmq::sockopt::ipv6, endpoint.find('[') != std::string::npos);
  if (client) security::use_as_curve_client(sub, *client);
  for (const std::string& topic : few_enough(topics)) sub.set(zmq::sockopt::subscribe, topic);
  try {
    sub.connect(endpoint);
  } catch (const zmq::error_t& error) {
    throw Error(Fault::usage, "endpoint " + endpoint + ": " + error.what() +
                                  "; give it as tcp://127.0.0.1:PORT or ipc:///PATH");
  }
}

Subscriber::~Subscriber() = default;

void Subscriber::subscribe(const std::string& topic) {
  socket_->sub.set(zmq::sockopt::subscribe, topic);
}

void Subscriber::unsubscribe(const std::string& topic) {
  socket_->sub.set(zmq::sockopt::unsubscribe, topic);
}

// libzmq itself connects again after every failure that may be temporary; it does not count a
// refusal of the key among these.
void Subscriber::try_again() {
  constexpr std::int64_t between_ns = 1'000'000'000;
  using State = security::HandshakeWatch::State;
  const State now = state();
  const std::int64_t now_ns = host_clock().steady_ns();
  const bool is_let_in = now == State::pending || now == State::connected;
  if (is_let_in || now == State::unanswered || now_ns - tried_ns_ < between_ns) return;
  tried_ns_ = now_ns;
  try {
    socket_->sub.disconnect(endpoint_);
  } catch (const zmq::error_t&) {
    // libzmq had already given up this endpoint.
  }
  socket_->sub.connect(endpoint_);
}

security::HandshakeWatch::State Subscriber::state() { return socket_->watch.state(); }

void Subscriber::wait(int descriptor, std::chrono::milliseconds timeout) {
  std::array<zmq::pollitem_t, 2> items{
      {{socket_->sub.handle(), 0, ZMQ_POLLIN, 0}, {nullptr, descriptor, ZMQ_POLLIN, 0}}};
  try {
    zmq::poll(items.data(), items.size(), timeout);
  } catch (const zmq::error_t&) {
    // A signal's handler ran: as good as a message.
  }
}

std::optional<Subscriber::Message> Subscriber::receive(std::chrono::milliseconds timeout) {
  socket_->sub.set(zmq::sockopt::rcvtimeo, static_cast<int>(timeout.count()));
  zmq::message_t topic;
  zmq::message_t json;
  if (!socket_->sub.recv(topic)) {
    try_again();
    return std::nullopt;
  }
  if (!topic.more() || !socket_->sub.recv(json)) return std::nullopt;
  bool more = json.more();
  const bool two_parts = !more;
  for (zmq::message_t rest; more; more = rest.more()) {
    if (!socket_->sub.recv(rest)) break;
  }
  if (!two_parts) return std::nullopt;
  return Message{topic.to_string(), json.to_string()};
}

}  // namespace splid::sockets
