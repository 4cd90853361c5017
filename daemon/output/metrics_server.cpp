#include "daemon/output/metrics_server.hpp"

#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>
#include <vector>

namespace splid {
namespace {

constexpr std::int64_t accept_pause_ns = 100'000'000;
constexpr int slice_ms = 100;

std::string place(const std::string& endpoint) {
  constexpr std::size_t scheme_bytes = 6;  // tcp://
  return endpoint.substr(scheme_bytes);
}

}  // namespace

MetricsServer::MetricsServer(const std::string& address, std::function<std::string()> text,
                             security::Refusals* refusals, const Clock& clock)
    : listener_("metrics.http", "tcp://" + address, address),
      text_(std::move(text)),
      refusals_(refusals),
      clock_(clock) {
  thread_ = std::thread([this] { run(); });
}

MetricsServer::~MetricsServer() {
  ending_ = true;
  wake_.notify();
  thread_.join();
}

std::string MetricsServer::url() const {
  return "http://" + place(listener_.endpoint()) + "/metrics";
}

void MetricsServer::run() {
  pthread_setname_np(pthread_self(), "metrics");
  while (!ending_) {
    wait();
    wake_.clear();
    accept_some();
    serve();
  }
}

void MetricsServer::wait() {
  const bool accepts = clock_.steady_ns() >= accept_again_ns_;
  std::vector<pollfd> items{{wake_.get(), POLLIN, 0}, {accepts ? listener_.get() : -1, POLLIN, 0}};
  for (const HttpExchange& exchange : exchanges_) {
    const short meant = exchange.answers() ? POLLOUT : POLLIN;
    items.push_back({exchange.socket(), meant, 0});
  }
  const bool has_deadline = !exchanges_.empty() || !accepts;
  (void)::poll(items.data(), items.size(), has_deadline ? slice_ms : -1);
}

void MetricsServer::accept_some() {
  for (std::size_t i = 0; i < most_connections; ++i) {
    if (clock_.steady_ns() < accept_again_ns_) return;
    FileDescriptor socket(
        ::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.is_open()) {
      sockets::Peer peer = sockets::peer_of(socket.get());
      if (!make_room(peer)) continue;
      exchanges_.emplace_back(std::move(socket), std::move(peer), clock_.steady_ns());
    } else if (errno == EAGAIN) {
      return;
    } else if (errno != ECONNABORTED && errno != EINTR) {
      accept_again_ns_ = clock_.steady_ns() + accept_pause_ns;
    }
  }
}

// The oldest connection whose request is not whole is closed.
bool MetricsServer::make_room(const sockets::Peer& peer) {
  if (exchanges_.size() < most_connections) return true;
  auto oldest = exchanges_.begin();
  while (oldest != exchanges_.end() && oldest->answers()) ++oldest;
  const bool found = oldest != exchanges_.end();
  if (refusals_ != nullptr) {
    const sockets::Peer& who = found ? oldest->peer() : peer;
    refusals_->add(
        security::Refusal::crowd, who.group,
        "refused " + who.name + " at " + url() + ": it holds a connection for which others wait");
  }
  if (found) exchanges_.erase(oldest);
  return found;
}

void MetricsServer::serve() {
  const std::int64_t now_ns = clock_.steady_ns();
  std::erase_if(exchanges_, [&](HttpExchange& exchange) { return !exchange.go_on(text_, now_ns); });
}

}  // namespace splid
