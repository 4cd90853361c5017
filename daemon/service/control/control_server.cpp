#include "daemon/service/control/control_server.hpp"

#include <pthread.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "daemon/base/wake_descriptor.hpp"
#include "daemon/security/server_security.hpp"
#include "daemon/service/control/control_endpoint.hpp"
#include "daemon/service/control/unix_listener.hpp"
#include "daemon/sockets/gate.hpp"

namespace splid::control {
namespace {

using std::chrono::milliseconds;

// Design note: 10,000 requests a second take the thread a few percent of a core. More requests than
// that would cost frames their time, so ZeroMQ lets their senders wait.
constexpr int requests_at_once = 100;
constexpr milliseconds pause_between{10};

constexpr milliseconds linger{300};
constexpr int requests_queued = 100;  // for each client
constexpr int replies_queued = 100;   // for each client
constexpr int handshake_ms = 5000;
constexpr std::size_t max_parts = 3;  // identity, perhaps an empty part, the request

// The sender of a request: the parts before its JSON.
using Sender = std::vector<zmq::message_t>;

struct Received {
  Sender sender;
  std::string text;
  bool is_whole = false;  // has as many parts as a request has to have
};

Received take_apart(std::vector<zmq::message_t> parts) {
  Received received;
  // A REQ socket puts an empty part before its request, and wants one before the reply.
  const std::size_t before = parts.size() > 2 && parts[1].empty() ? 2 : 1;
  received.is_whole = parts.size() == before + 1;
  if (received.is_whole) received.text = parts.back().to_string();
  for (std::size_t i = 0; i < std::min(before, parts.size()); ++i) {
    received.sender.push_back(std::move(parts[i]));
  }
  return received;
}

Reply refusal(const std::string& request, const Error& error) {
  return {request, error.fault(), error.what()};
}

}  // namespace

struct Server::Service {
  Service(const std::string& bound_to, Handlers control_handlers, security::Authenticator* who,
          security::Refusals& refusals);
  ~Service();

  void open(const std::string& to, security::Refusals& refusals);
  void serve();
  void read_requests();
  std::optional<Received> receive();
  void answer(Received received);
  std::optional<Reply> take(const Request& asked, Sender& sender);
  void send(Sender sender, const Reply& reply);
  void send_result();
  void work(const std::stop_token& stop);
  Reply perform(const Request& next, const std::stop_token& stop) const;

  std::optional<UnixListener> listener;  // absent for TCP
  std::optional<sockets::PrivateDoor> door;
  std::optional<sockets::Gate> gate;  // lets the last reply out when the socket is closed
  Handlers handlers;
  security::Authenticator* authenticator;  // for TCP; otherwise null
  zmq::context_t own_context{1};
  zmq::socket_t router{authenticator == nullptr ? own_context : authenticator->context(),
                       zmq::socket_type::router};
  WakeDescriptor wake;  // wakes `control` when a result is there or the server ends

  // The thread `control` only.
  Sender waiting;     // the sender of the action that is running
  std::string doing;  // the name of that action; empty: none is running

  std::mutex mutex;
  std::condition_variable_any changed;
  std::optional<Request> request;  // guarded by the mutex: to be carried out
  std::optional<Reply> result;     // guarded by the mutex: to be sent
  bool ending = false;             // guarded by the mutex

  std::thread server;
  std::jthread worker;
};

Server::Server(const std::string& endpoint, Handlers handlers,
               security::Authenticator* authenticator, security::Refusals& refusals)
    : service_(std::make_unique<Service>(endpoint, std::move(handlers), authenticator, refusals)) {}

Server::~Server() = default;

const std::string& Server::endpoint() const { return service_->gate->endpoint(); }

Server::Service::Service(const std::string& bound_to, Handlers control_handlers,
                         security::Authenticator* who, security::Refusals& refusals)
    : handlers(std::move(control_handlers)), authenticator(who) {
  router.set(zmq::sockopt::linger, static_cast<int>(linger.count()));
  router.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(max_request_bytes));
  router.set(zmq::sockopt::rcvhwm, requests_queued);
  router.set(zmq::sockopt::sndhwm, replies_queued);
  router.set(zmq::sockopt::handshake_ivl, handshake_ms);
  open(bound_to, refusals);
  server = std::thread([this] { serve(); });
  worker = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

Server::Service::~Service() {
  worker.request_stop();
  worker.join();
  {
    const std::scoped_lock lock(mutex);
    ending = true;
  }
  wake.notify();
  server.join();
  router.close();
  own_context.close();
  if (authenticator != nullptr) authenticator->name_peers(security::control_domain, nullptr);
}

void Server::Service::open(const std::string& to, security::Refusals& refusals) {
  const bool curve = authenticator != nullptr;
  if (!curve) listener.emplace(socket_file_of(to));
  sockets::ListeningSocket outside = curve ? sockets::ListeningSocket("control.endpoint", to)
                                           : sockets::ListeningSocket(listener->release(), to);
  if (curve) authenticator->protect(router, security::control_domain);
  door.emplace(router);
  gate.emplace(std::move(outside), sockets::Gate::Behind{*door, sockets::control_limits, curve},
               refusals, host_clock());
  if (curve)
    authenticator->name_peers(security::control_domain, [this] { return gate->judged_peer(); });
}

void Server::Service::serve() {
  pthread_setname_np(pthread_self(), "control");
  for (bool end = false; !end;) {
    std::array<zmq::pollitem_t, 2> items{
        {{router.handle(), 0, ZMQ_POLLIN, 0}, {nullptr, wake.get(), ZMQ_POLLIN, 0}}};
    zmq::poll(items.data(), items.size(), milliseconds{-1});
    wake.clear();
    {
      const std::scoped_lock lock(mutex);
      end = ending;
    }
    send_result();
    if (!end) read_requests();
  }
}

void Server::Service::read_requests() {
  for (int i = 0; i < requests_at_once; ++i) {
    std::optional<Received> received = receive();
    if (!received) return;
    answer(std::move(*received));
  }
  std::this_thread::sleep_for(pause_between);
}

std::optional<Received> Server::Service::receive() {
  std::vector<zmq::message_t> parts;
  bool more = true;
  bool too_many = false;
  while (more) {
    zmq::message_t part;
    if (!router.recv(part, zmq::recv_flags::dontwait)) return std::nullopt;
    more = part.more();
    too_many = parts.size() == max_parts;
    if (!too_many) parts.push_back(std::move(part));
  }
  Received received = take_apart(std::move(parts));
  received.is_whole = received.is_whole && !too_many;
  return received;
}

void Server::Service::answer(Received received) {
  std::string name;
  std::optional<Reply> reply;
  try {
    if (!received.is_whole) throw Error(Fault::usage, "request: must be one part of JSON");
    const Request asked = request_from_json(received.text);
    name = to_string(asked.command);
    reply = take(asked, received.sender);
  } catch (const Error& error) {
    reply = refusal(name, error);
  } catch (const std::exception& error) {
    reply = refusal(name, Error(Fault::device, error.what()));
  }
  if (reply) send(std::move(received.sender), *reply);
}

// The reply to a request; absent where it comes later, and then the sender has become `waiting`.
std::optional<Reply> Server::Service::take(const Request& asked, Sender& sender) {
  if (asked.command == Command::status) return handlers.status(doing);
  if (!doing.empty()) {
    throw Error(Fault::device,
                "busy: " + doing + " is running; ask again when it is done (see status)");
  }
  doing = to_string(asked.command);
  waiting = std::move(sender);
  const std::scoped_lock lock(mutex);
  request = asked;
  changed.notify_all();
  return std::nullopt;
}

void Server::Service::send(Sender sender, const Reply& reply) {
  // For a client that is gone or does not read, ROUTER drops the reply; it never waits.
  try {
    for (zmq::message_t& part : sender) {
      router.send(part, zmq::send_flags::sndmore | zmq::send_flags::dontwait);
    }
    router.send(zmq::buffer(to_json(reply)), zmq::send_flags::dontwait);
  } catch (const zmq::error_t&) {
    return;
  }
}

void Server::Service::send_result() {
  std::optional<Reply> reply;
  {
    const std::scoped_lock lock(mutex);
    reply = std::exchange(result, std::nullopt);
  }
  if (!reply) return;
  doing.clear();
  send(std::exchange(waiting, {}), *reply);
}

void Server::Service::work(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "control-work");
  while (!stop.stop_requested()) {
    std::optional<Request> next;
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, stop, [this] { return request.has_value(); });
      next = std::exchange(request, std::nullopt);
    }
    if (!next) continue;
    Reply reply = perform(*next, stop);
    const std::scoped_lock lock(mutex);
    result = std::move(reply);
    wake.notify();
  }
}

Reply Server::Service::perform(const Request& next, const std::stop_token& stop) const {
  const char* name = to_string(next.command);
  try {
    return handlers.perform(next, stop);
  } catch (const Error& error) {
    return refusal(name, error);
  } catch (const std::exception& error) {
    return refusal(name, Error(Fault::device, error.what()));
  }
}

}  // namespace splid::control
