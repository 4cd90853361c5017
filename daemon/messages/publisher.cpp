#include "daemon/messages/publisher.hpp"

#include <cerrno>
#include <string_view>
#include <zmq.hpp>

#include "daemon/security/server_security.hpp"
#include "protocol/error.hpp"
#include "protocol/messages.hpp"

namespace splid {
namespace {

// Bytes of the largest message taken from a subscriber. All it has to say is a topic.
constexpr std::int64_t max_incoming_bytes = 1024;

// Subscriptions read in one call, so that a subscriber that sends nothing else cannot hold a frame
// up: 64 take some 10 us.
constexpr int max_subscriptions_a_call = 64;

constexpr int heartbeat_interval_ms = 2000;
constexpr int heartbeat_timeout_ms = 6000;

bool is_prefix(std::string_view prefix, std::string_view text) {
  return text.substr(0, prefix.size()) == prefix;
}

// key: of the configuration, that names the endpoint.
[[noreturn]] void throw_bind_error(const std::string& key, const std::string& endpoint,
                                   const zmq::error_t& error) {
  const std::string place = key + " " + endpoint + ": " + error.what();
  switch (error.num()) {
    case EINVAL:
    case EPROTONOSUPPORT:
    case ENOCOMPATPROTO:
      throw Error(Fault::usage, place + "; give it as tcp://127.0.0.1:PORT or ipc:///PATH");
    case EADDRINUSE:
      throw EndpointTaken(endpoint, place);
    default:
      throw Error(Fault::device,
                  place + "; give " + key + " an address of this machine that may be bound");
  }
}

// Returns the endpoint as bound.
std::string bind_endpoint(zmq::socket_t& socket, const std::string& key,
                          const std::string& endpoint) {
  // Only where it is asked for: with it a wildcard would be of IPv6, which not every kernel has.
  socket.set(zmq::sockopt::ipv6, endpoint.find('[') != std::string::npos);
  try {
    socket.bind(endpoint);
  } catch (const zmq::error_t& error) {
    throw_bind_error(key, endpoint, error);
  }
  return socket.get(zmq::sockopt::last_endpoint);
}

}  // namespace

struct Publisher::Socket {
  explicit Socket(Authenticator* its_authenticator) : authenticator(its_authenticator) {}
  ~Socket() {
    if (authenticator != nullptr) authenticator->release(xpub);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  Authenticator* authenticator;
  zmq::context_t own_context{1};  // used where there is no authenticator
  zmq::socket_t xpub{authenticator == nullptr ? own_context : authenticator->context(),
                     zmq::socket_type::xpub};
  bool frames_wanted = false;
};

Publisher::Publisher(const std::string& endpoint, int queue_messages)
    : Publisher(endpoint, queue_messages, {}) {}

// Design note: one socket with two endpoints, since libzmq applies a socket's options to what it
// binds from then on: the plain endpoint is bound before the socket is protected. A message then
// has the same place in both queues and is packed once, and each subscriber has a queue of its own.
Publisher::Publisher(const std::string& endpoint, int queue_messages, const Access& access)
    : socket_(std::make_unique<Socket>(access.authenticator)) {
  zmq::socket_t& xpub = socket_->xpub;
  xpub.set(zmq::sockopt::xpub_verbose, true);
  xpub.set(zmq::sockopt::sndhwm, queue_messages);
  xpub.set(zmq::sockopt::linger, static_cast<int>(linger.count()));
  xpub.set(zmq::sockopt::maxmsgsize, max_incoming_bytes);
  xpub.set(zmq::sockopt::heartbeat_ivl, heartbeat_interval_ms);
  xpub.set(zmq::sockopt::heartbeat_timeout, heartbeat_timeout_ms);
  if (!access.local_endpoint.empty()) {
    local_endpoint_ = bind_endpoint(xpub, "publish.local_endpoint", access.local_endpoint);
  }
  if (access.authenticator != nullptr) access.authenticator->protect(xpub, publish_domain);
  if (!endpoint.empty()) endpoint_ = bind_endpoint(xpub, "publish.endpoint", endpoint);
}

Publisher::~Publisher() = default;

void Publisher::publish_frame(const std::string& json) { send(topic_frame, json); }

void Publisher::publish_status(const std::string& json) {
  {
    const std::scoped_lock lock(status_mutex_);
    status_ = json;
  }
  send(topic_status, json);
}

std::string Publisher::last_status() const {
  const std::scoped_lock lock(status_mutex_);
  return status_;
}

void Publisher::publish_version(const std::string& json) {
  version_ = json;
  send(topic_version, json);
}

void Publisher::greet() {
  bool version_wanted = false;
  bool status_wanted = false;
  zmq::message_t message;
  for (int i = 0; i < max_subscriptions_a_call; ++i) {
    if (!socket_->xpub.recv(message, zmq::recv_flags::dontwait)) break;
    const std::string_view text = message.to_string_view();
    if (text.empty() || text.front() != '\x01') continue;  // 1 subscribes; the topic follows
    const std::string_view topic = text.substr(1);
    version_wanted |= is_prefix(topic, topic_version);
    status_wanted |= is_prefix(topic, topic_status);
    socket_->frames_wanted |= is_prefix(topic, topic_frame);
  }
  if (version_wanted && !version_.empty()) send(topic_version, version_);
  if (status_wanted && !status_.empty()) send(topic_status, status_);
}

bool Publisher::wait_for_subscriber(std::chrono::milliseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  greet();
  while (!socket_->frames_wanted && std::chrono::steady_clock::now() < until) {
    zmq::pollitem_t item{socket_->xpub.handle(), 0, ZMQ_POLLIN, 0};
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    zmq::poll(&item, 1, std::min(left, std::chrono::milliseconds{100}));
    greet();
  }
  return socket_->frames_wanted;
}

void Publisher::send(const char* topic, const std::string& json) {
  // XPUB drops for a subscriber whose queue is full and never blocks: no result to look at.
  (void)socket_->xpub.send(zmq::buffer(std::string_view{topic}),
                           zmq::send_flags::sndmore | zmq::send_flags::dontwait);
  (void)socket_->xpub.send(zmq::buffer(json), zmq::send_flags::dontwait);
}

}  // namespace splid
