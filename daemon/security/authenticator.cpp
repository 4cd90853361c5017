#include "daemon/security/authenticator.hpp"

#include <pthread.h>

#include <chrono>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "daemon/security/curve_socket.hpp"

namespace splid::security {
namespace {

constexpr std::chrono::milliseconds slice{50};

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

}  // namespace

struct Authenticator::Sockets {
  zmq::context_t context{1};
  zmq::socket_t zap{context, zmq::socket_type::rep};
};

Authenticator::Authenticator(CurveKeyPair own, Refusals& refusals)
    : own_(std::move(own)), refusals_(refusals), sockets_(std::make_unique<Sockets>()) {
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
}

void Authenticator::name_peers(const std::string& domain,
                               std::function<std::string()> judged_peer) {
  const std::scoped_lock lock(mutex_);
  judged_peers_[domain] = std::move(judged_peer);
}

std::string Authenticator::peer_of(const ZapRequest& request) const {
  const std::scoped_lock lock(mutex_);
  const auto who = judged_peers_.find(request.domain);
  const std::string named = who == judged_peers_.end() || !who->second ? "" : who->second();
  return named.empty() ? request.address : named;
}

void Authenticator::serve() {
  pthread_setname_np(pthread_self(), "authenticator");
  while (!ending_) {
    zmq::pollitem_t item{sockets_->zap.handle(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&item, 1, slice.count()) > 0) answer();
    refusals_.tick();
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
  const std::string peer = peer_of(request);
  const auto key = curve_key_of(request);
  if (!key) {
    refusals_.add(Refusal::no_key, peer, "refused " + peer + ": it gives no CURVE key");
    return refusal;
  }
  if (const auto name = name_of(request.domain, *key)) {
    return {ZapReply::Status::admitted, "", *name};
  }
  refusals_.add(
      Refusal::not_listed, peer,
      "refused " + peer + ": its key " + key_beginning(*key) + " is not on the allow-list");
  return refusal;
}

}  // namespace splid::security
