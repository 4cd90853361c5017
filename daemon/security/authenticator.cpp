#include "daemon/security/authenticator.hpp"

#include <pthread.h>

#include <chrono>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "daemon/security/curve_socket.hpp"

namespace splid {
namespace {

constexpr std::chrono::milliseconds slice{50};

// Refusals that libzmq decides on itself, before it asks. Those by ZAP are known already.
constexpr int watched_events = ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                               ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_ACCEPT_FAILED;

std::vector<std::string> receive_parts(zmq::socket_t& socket) {
  std::vector<std::string> parts;
  zmq::message_t part;
  do {
    if (!socket.recv(part, zmq::recv_flags::dontwait)) break;
    parts.push_back(part.to_string());
  } while (part.more());
  return parts;
}

void send_parts(zmq::socket_t& socket, std::span<const std::string> parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool more = i + 1 < parts.size();
    (void)socket.send(zmq::buffer(parts[i]),
                      more ? zmq::send_flags::sndmore : zmq::send_flags::none);
  }
}

// Empty: not worth a sentence, such as a port scan that closes at once.
std::string describe(const SocketMonitor::Event& event) {
  if (event.kind == ZMQ_EVENT_ACCEPT_FAILED) {
    return "a connection to " + event.endpoint +
           " could not be taken: " + zmq_strerror(static_cast<int>(event.value));
  }
  if (event.kind != ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) return {};
  switch (event.value) {
    case ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH:
      return "refused a connection to " + event.endpoint +
             ": one of the two speaks CURVE and the other does not";
    case ZMQ_PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC:
    case ZMQ_PROTOCOL_ERROR_ZMTP_KEY_EXCHANGE:
      return "refused a connection to " + event.endpoint +
             ": it was made for another server's key, or is a repetition of an old one";
    default:
      return "refused a connection to " + event.endpoint + ": it does not speak ZMTP as it should";
  }
}

}  // namespace

struct Authenticator::Sockets {
  zmq::context_t context{1};
  zmq::socket_t zap{context, zmq::socket_type::rep};
};

Authenticator::Authenticator(CurveKeyPair own, std::function<void(const std::string&)> notice,
                             const Clock& clock)
    : own_(std::move(own)),
      clock_(clock),
      sockets_(std::make_unique<Sockets>()),
      log_(std::move(notice)) {
  sockets_->zap.set(zmq::sockopt::linger, 0);
  sockets_->zap.bind(zap_endpoint);
  thread_ = std::thread([this] { serve(); });
}

Authenticator::~Authenticator() {
  ending_ = true;
  thread_.join();
}

zmq::context_t& Authenticator::context() { return sockets_->context; }

void Authenticator::allow(const std::string& domain, AllowList list) {
  const std::scoped_lock lock(mutex_);
  lists_[domain] = std::move(list);
}

AllowList Authenticator::allowed(const std::string& domain) const {
  const std::scoped_lock lock(mutex_);
  const auto list = lists_.find(domain);
  return list == lists_.end() ? AllowList{} : list->second;
}

std::optional<std::string> Authenticator::name_of(const std::string& domain,
                                                  const std::string& public_key) const {
  const std::scoped_lock lock(mutex_);
  const auto list = lists_.find(domain);
  return list == lists_.end() ? std::nullopt : list->second.name_of(public_key);
}

void Authenticator::protect(zmq::socket_t& socket, const std::string& domain) {
  use_as_curve_server(socket, own_.secret_key, domain);
  const std::scoped_lock lock(mutex_);
  monitors_[&socket] = std::make_unique<SocketMonitor>(context(), socket, watched_events);
}

void Authenticator::release(zmq::socket_t& socket) {
  const std::scoped_lock lock(mutex_);
  monitors_.erase(&socket);
}

void Authenticator::serve() {
  pthread_setname_np(pthread_self(), "authenticator");
  while (!ending_) {
    zmq::pollitem_t item{sockets_->zap.handle(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&item, 1, slice.count()) > 0) answer();
    look_at_handshakes();
    log_.tick(clock_.steady_ns());
  }
}

void Authenticator::answer() {
  const std::vector<std::string> parts = receive_parts(sockets_->zap);
  const auto request = parse_zap_request(parts);
  const ZapReply reply =
      request ? judge(*request)
              : ZapReply{ZapReply::Status::malformed, "not a request of ZAP 1.0", ""};
  send_parts(sockets_->zap, zap_parts(request ? request->request_id : "", reply));
}

ZapReply Authenticator::judge(const ZapRequest& request) {
  ZapReply refusal{ZapReply::Status::refused, "not allowed", ""};
  const auto key = curve_key_of(request);
  if (!key) {
    refuse("refused " + request.address + ": it gives no CURVE key");
    return refusal;
  }
  if (const auto name = name_of(request.domain, *key)) {
    return {ZapReply::Status::admitted, "", *name};
  }
  refuse("refused " + request.address + ": its key " + key_beginning(*key) +
         " is not on the allow-list");
  return refusal;
}

void Authenticator::look_at_handshakes() {
  const std::scoped_lock lock(mutex_);
  for (const auto& [socket, monitor] : monitors_) {
    while (const auto event = monitor->next()) {
      const std::string sentence = describe(*event);
      if (sentence.empty()) {
        ++refused_;
      } else {
        refuse(sentence);
      }
    }
  }
}

void Authenticator::refuse(const std::string& sentence) {
  ++refused_;
  log_.refused(sentence, clock_.steady_ns());
}

}  // namespace splid
