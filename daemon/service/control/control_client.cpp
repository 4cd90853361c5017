#include "daemon/service/control/control_client.hpp"

#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>
#include <zmq.hpp>

#include "daemon/base/clock.hpp"
#include "daemon/security/handshake_watch.hpp"
#include "daemon/service/control/control_endpoint.hpp"

namespace splid::control {
namespace {

using Time = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds patience{2000};
// A daemon that has let this client in is there, though a machine at its limits keeps it from
// answering.
constexpr milliseconds patience_once_connected{10'000};
constexpr milliseconds between_questions{500};
constexpr milliseconds slice{100};  // how often a stop request is looked for

}  // namespace

struct Client::Socket {
  zmq::context_t context{1};
  zmq::socket_t dealer{context, zmq::socket_type::dealer};
  security::HandshakeWatch watch{context, dealer, host_clock()};
};

Client::Client(std::string endpoint, std::optional<security::CurveClient> keys)
    : endpoint_(std::move(endpoint)), keys_(std::move(keys)) {
  if (!keys_ && ::access(socket_file_of(endpoint_).c_str(), W_OK) != 0) {
    const int why = errno;
    fail(" (" + std::generic_category().message(why) + ")" +
         (why == EACCES ? "; it is its owner's alone: ask as that user, or as root"
                        : "; is the service running?"));
  }
  socket_ = std::make_unique<Socket>();
  socket_->dealer.set(zmq::sockopt::linger, 0);
  socket_->dealer.set(zmq::sockopt::rcvtimeo, static_cast<int>(slice.count()));
  socket_->dealer.set(zmq::sockopt::ipv6, endpoint_.find('[') != std::string::npos);
  if (keys_) security::use_as_curve_client(socket_->dealer, *keys_);
  socket_->dealer.connect(endpoint_);
}

Client::~Client() = default;

void Client::send(const Request& request) {
  (void)socket_->dealer.send(zmq::buffer(to_json(request)), zmq::send_flags::dontwait);
}

void Client::fail(const std::string& why) const {
  throw Error(Fault::device, "no splid answers at " + endpoint_ + why);
}

void Client::fail_silent() const {
  using State = security::HandshakeWatch::State;
  const State state = socket_->watch.state();
  if (state == State::pending) fail("; is the service running?");
  if (state == State::connected) fail(": it accepted this client, but sent nothing for 10 s");
  throw Error(Fault::device, in_words(state, endpoint_, keys_ ? &*keys_ : nullptr));
}

milliseconds Client::patience_at_present() const {
  const bool connected = socket_->watch.state() == security::HandshakeWatch::State::connected;
  return connected ? patience_once_connected : patience;
}

// While a request is under way, the daemon is asked for its status again and again. A daemon that
// answers is alive, however long the request takes.
Reply Client::ask(const Request& request, const Progress& progress, const std::stop_token& stop) {
  const std::string wanted = to_string(request.command);
  Time::time_point heard = Time::now();
  Time::time_point asked = heard;
  send(request);
  while (!stop.stop_requested()) {
    zmq::message_t message;
    if (socket_->dealer.recv(message)) {
      heard = Time::now();
      Reply reply = reply_from_json(message.to_string());
      if (reply.request == wanted || reply.request.empty()) return reply;
      progress(reply);
    }
    const Time::time_point now = Time::now();
    if (now - heard > patience_at_present()) fail_silent();
    if (now - asked < between_questions) continue;
    asked = now;
    send({});
  }
  throw Error(Fault::usage, "stopped waiting for " + wanted + ", which goes on in the daemon");
}

}  // namespace splid::control
