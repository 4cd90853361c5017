#include "daemon/sockets/gate.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

namespace splid::sockets {
namespace {

using Result = Relay::Result;

constexpr std::size_t piece_bytes = 16'384;
constexpr int accepted_a_turn = 16;
constexpr std::int64_t ms_ns = 1'000'000;
constexpr std::int64_t second_ns = 1'000 * ms_ns;

// How long the gate accepts nobody when no file descriptor is left.
constexpr std::int64_t accept_pause_ns = 100 * ms_ns;
// A connection that has not finished its handshake within this time makes way for others.
constexpr std::int64_t handshake_patience_ns = second_ns;
// How long to wait for the check of a key, which usually takes a millisecond.
constexpr std::int64_t judge_patience_ns = second_ns;
// How long a peer has to take what the socket behind sent before that socket closed the connection.
constexpr std::int64_t goodbye_patience_ns = 5 * second_ns;

// Tokens for epoll; both sockets of a connection have the connection's number as their token.
constexpr std::uint64_t listener_token = 0;
constexpr std::uint64_t wake_token = ~std::uint64_t{0};

constexpr std::uint32_t all_changes = EPOLLIN | EPOLLOUT | EPOLLRDHUP | EPOLLET;

std::string in_words(const GateLimits& limits) {
  return std::to_string(limits.connection.frames) + " frames or " +
         std::to_string(limits.connection.bytes / 1024) + " KiB";
}

}  // namespace

Gate::Gate(ListeningSocket listener, const Behind& behind, security::Refusals& refusals,
           const Clock& clock)
    : listener_(std::move(listener)),
      door_(behind.door),
      limits_(behind.limits),
      curve_(behind.curve),
      refusals_(refusals),
      clock_(clock),
      name_(listener_.endpoint()),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      scratch_(piece_bytes) {
  add_to_epoll(listener_.get(), listener_token, EPOLLIN);
  add_to_epoll(wake_.get(), wake_token, EPOLLIN | EPOLLET);
  thread_ = std::thread([this] { run(); });
}

Gate::~Gate() {
  ending_ = true;
  (void)::eventfd_write(wake_.get(), 1);
  thread_.join();
}

std::string Gate::judged_peer() const {
  const std::scoped_lock lock(mutex_);
  return judged_peer_;
}

void Gate::run() {
  pthread_setname_np(pthread_self(), "gate");
  std::array<epoll_event, 64> events{};
  std::int64_t end_ns = 0;
  while (!is_done(end_ns)) {
    const int count = ::epoll_wait(epoll_.get(), events.data(), events.size(), patience_ms());
    if (ending_ && end_ns == 0) {
      end_ns = clock_.steady_ns() + std::chrono::nanoseconds(drain).count();
      listener_.close();
    }
    for (int i = 0; i < count; ++i) take_event(events.at(static_cast<std::size_t>(i)).data.u64);
    serve_again();
    look_after();
  }
  connections_.clear();
}

// Whether the gate's thread may end. end_ns: when the patience with peers that still have something
// to take is over; 0: the gate is not ending.
bool Gate::is_done(std::int64_t end_ns) const {
  return end_ns != 0 && (connections_.empty() || clock_.steady_ns() >= end_ns);
}

int Gate::patience_ms() const {
  if (!again_.empty()) return 0;
  if (ending_) return 10;
  return accept_again_ns_ != 0 || judged_ != 0 ? 100 : 1000;
}

void Gate::add_to_epoll(int descriptor, std::uint64_t token, std::uint32_t events) const {
  epoll_event event{};
  event.events = events;
  event.data.u64 = token;
  (void)::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event);
}

void Gate::take_event(std::uint64_t token) {
  if (token == wake_token) return;
  if (token == listener_token) {
    if (listener_.is_open()) accept_some();
  } else {
    serve(token);
  }
}

void Gate::serve_again() {
  for (const std::uint64_t id : std::exchange(again_, {})) serve(id);
}

void Gate::accept_some() {
  for (int i = 0; i < accepted_a_turn && accept_again_ns_ == 0; ++i) {
    FileDescriptor outside(
        ::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (outside.is_open()) {
      admit(std::move(outside));
    } else {
      const bool is_gone = errno == ECONNABORTED || errno == EINTR || errno == EPROTO;
      if (is_gone) continue;
      if (errno != EAGAIN) pause_accepting();
      return;
    }
  }
}

void Gate::pause_accepting() {
  accept_again_ns_ = clock_.steady_ns() + accept_pause_ns;
  (void)::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, listener_.get(), nullptr);
}

void Gate::admit(FileDescriptor outside) {
  const Peer peer = peer_of(outside.get());
  KnownPeer& known = peers_[peer.group];
  if (!has_room_for(peer, known)) return;
  FileDescriptor inside = door_.connect();
  if (!inside.is_open()) {
    pause_accepting();
    return;
  }
  const int yes = 1;
  (void)::setsockopt(outside.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  const std::uint64_t id = next_id_++;
  auto connection = std::make_unique<GateConnection>(
      std::move(outside), std::move(inside), peer, limits_, known.use, curve_, clock_.steady_ns());
  add_to_epoll(connection->outside(), id, all_changes);
  add_to_epoll(connection->inside(), id, all_changes);
  connections_.emplace(id, std::move(connection));
}

// Returns whether the peer may have one more connection; refuses the peer otherwise.
bool Gate::has_room_for(const Peer& peer, KnownPeer& known) {
  const std::int64_t now_ns = clock_.steady_ns();
  const double since_s =
      known.since_ns == 0 ? 1e9 : static_cast<double>(now_ns - known.since_ns) / second_ns;
  known.new_connections =
      std::min(limits_.new_connections_at_once,
               known.new_connections + since_s * limits_.new_connections_a_second);
  known.since_ns = now_ns;
  if (known.new_connections < 1) {
    refuse(security::Refusal::crowd, peer, "it connects again and again, or after floods");
    return false;
  }
  known.new_connections -= 1;
  if (known.use.connections >= limits_.connections_a_peer && !make_room(&peer.group)) {
    refuse(security::Refusal::crowd, peer,
           "it has " + std::to_string(known.use.connections) + " connections already");
    return false;
  }
  if (connections_.size() >= limits_.connections && !make_room(nullptr)) {
    refuse(security::Refusal::crowd, peer,
           "there are " + std::to_string(connections_.size()) + " connections already");
    return false;
  }
  return true;
}

// Ends one connection that had time for a handshake and has not made it; returns whether there was
// one. group: looks only at the connections of that group; null: at all connections.
bool Gate::make_room(const std::string* group) {
  const std::int64_t before_ns = clock_.steady_ns() - handshake_patience_ns;
  for (const auto& [id, connection] : connections_) {
    if (group != nullptr && connection->peer().group != *group) continue;
    if (connection->is_admitted() || connection->begin_ns() > before_ns) continue;
    refuse(security::Refusal::crowd, connection->peer(),
           "it holds a connection without a handshake");
    end(id);
    return true;
  }
  return false;
}

void Gate::serve(std::uint64_t id) {
  const auto found = connections_.find(id);
  if (found == connections_.end()) return;
  GateConnection& connection = *found->second;
  if (!pump(id, connection)) {
    end(id);
    return;
  }
  if (id == judged_ && connection.is_judged()) end_judgement();
  if (connection.waits_for_judgement() &&
      std::find(to_be_judged_.begin(), to_be_judged_.end(), id) == to_be_judged_.end()) {
    to_be_judged_.push_back(id);
  }
  judge_next();
}

// Passes bytes in both directions. False: the connection is over. Bytes from the socket behind go
// first, so that a peer learns why its connection ends.
bool Gate::pump(std::uint64_t id, GateConnection& connection) {
  const Result down = connection.down.pump(scratch_);
  const Result up = connection.up.pump(scratch_);
  const bool peer_is_gone = down == Result::broken || up == Result::ended;
  if (peer_is_gone || up == Result::refused || down == Result::ended) {
    say_why(connection, up, down);
    return false;
  }
  if (up == Result::broken && connection.ending_since_ns == 0) {
    connection.ending_since_ns = clock_.steady_ns();
  }
  if (up == Result::more || down == Result::more) again_.push_back(id);
  return true;
}

void Gate::end(std::uint64_t id) {
  connections_.erase(id);
  if (id == judged_) end_judgement();
  judge_next();
}

void Gate::say_why(const GateConnection& connection, Result up, Result down) {
  using Offence = GateConnection::Offence;
  const bool is_let_in = connection.is_admitted();
  switch (connection.offence()) {
    case Offence::other_protocol:
      refuse(security::Refusal::other_protocol, connection.peer(),
             "it does not speak ZMTP 3, ZeroMQ's");
      return;
    case Offence::long_frame:
      charge_flood(connection.peer());
      refuse(security::Refusal::flood, connection.peer(),
             "it sent a frame of more than " + std::to_string(limits_.frame_bytes) + " bytes");
      return;
    case Offence::flood:
      charge_flood(connection.peer());
      refuse(security::Refusal::flood, connection.peer(),
             "it sent more than a peer may send unanswered (" + in_words(limits_) + ")");
      return;
    case Offence::none:
      break;
  }
  const bool peer_left = up == Result::ended || down == Result::broken;
  if (!is_let_in) say_handshake(connection, peer_left);
}

// A flood costs as much as several new connections, so that a peer that floods again and again is
// kept out for some seconds.
void Gate::charge_flood(const Peer& peer) {
  double& left = peers_[peer.group].new_connections;
  left = std::max(left - limits_.connections_a_flood, -limits_.new_connections_at_once);
}

// Reports a handshake that failed. A key that is not listed is reported by the authenticator, which
// knows the key.
void Gate::say_handshake(const GateConnection& connection, bool peer_left) {
  const std::string asked = connection.other_mechanism();
  if (ending_ || connection.is_turned_away()) return;
  if (connection.has_spoken() && !asked.empty()) {
    refuse(security::Refusal::no_key, connection.peer(),
           curve_ ? "it gives no CURVE key (its socket asks for " + asked + ")"
                  : "it asks for " + asked + ", which this endpoint does not speak");
  } else if (connection.has_spoken() && !peer_left) {
    refuse(security::Refusal::broken_off, connection.peer(),
           curve_ ? "its handshake was made for another server's key, is a repetition of an old "
                    "one, or was never finished"
                  : "its handshake was malformed or was never finished");
  } else if (curve_ || !peer_left) {
    refusals_.add(security::Refusal::broken_off);
  }
}

void Gate::refuse(security::Refusal reason, const Peer& peer, const std::string& why) {
  refusals_.add(reason, peer.group, "refused " + peer.name + " at " + name_ + ": " + why);
}

// Lets the next connection have its key checked. Only one connection at a time is let through to
// the check, so that the authenticator knows which peer the key belongs to.
void Gate::judge_next() {
  while (judged_ == 0 && !to_be_judged_.empty()) {
    const std::uint64_t id = to_be_judged_.front();
    to_be_judged_.pop_front();
    const auto found = connections_.find(id);
    if (found == connections_.end()) continue;
    judged_ = id;
    judged_since_ns_ = clock_.steady_ns();
    {
      const std::scoped_lock lock(mutex_);
      judged_peer_ = found->second->peer().name;
    }
    found->second->let_judge();
    again_.push_back(id);
  }
}

void Gate::end_judgement() {
  judged_ = 0;
  const std::scoped_lock lock(mutex_);
  judged_peer_.clear();
}

// Does what depends on the time: accepts connections again after a pause, gives up a check of a key
// that gets no answer, and once a second ends connections whose peer does not take its last bytes
// and forgets peers that have no connection.
void Gate::look_after() {
  const std::int64_t now_ns = clock_.steady_ns();
  if (accept_again_ns_ != 0 && now_ns >= accept_again_ns_) {
    accept_again_ns_ = 0;
    if (listener_.is_open()) add_to_epoll(listener_.get(), listener_token, EPOLLIN);
  }
  if (judged_ != 0 && now_ns - judged_since_ns_ > judge_patience_ns) {
    end_judgement();
    judge_next();
  }
  if (now_ns < look_after_ns_) return;
  look_after_ns_ = now_ns + second_ns;
  refusals_.tick();
  std::erase_if(connections_, [&](const auto& item) {
    const std::int64_t since_ns = item.second->ending_since_ns;
    return since_ns != 0 && now_ns - since_ns > goodbye_patience_ns;
  });
  std::erase_if(peers_, [&](const auto& item) {
    constexpr std::int64_t forgotten_ns = 60 * second_ns;
    return item.second.use.connections == 0 && now_ns - item.second.since_ns > forgotten_ns;
  });
}

}  // namespace splid::sockets
