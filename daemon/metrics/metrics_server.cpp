#include "daemon/metrics/metrics_server.hpp"

#include <prometheus/exposer.h>

#include <chrono>
#include <exception>
#include <stop_token>
#include <thread>
#include <vector>

#include "drivers/client_socket.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr const char* threads = "2";
// A scrape sends its request at once; who does not is cut off before a second one is late.
constexpr const char* request_timeout_ms = "1000";

std::string host_of(const std::string& address) { return address.substr(0, address.rfind(':')); }

std::string port_of(const std::string& address) {
  const std::string port = address.substr(address.rfind(':') + 1);
  return port == "*" ? "0" : port;
}

}  // namespace

MetricsServer::MetricsServer(const std::string& address,
                             const std::shared_ptr<prometheus::Collectable>& collectable) {
  try {
    exposer_ = std::make_unique<prometheus::Exposer>(
        std::vector<std::string>{"listening_ports", host_of(address) + ":" + port_of(address),
                                 "num_threads", threads, "request_timeout_ms", request_timeout_ms});
  } catch (const std::exception&) {
    // The library does not say why.
    throw Error(Fault::device, "metrics.http " + address +
                                   ": cannot listen there; another program, maybe another splid, "
                                   "does, or it is no address of this machine: stop that or give "
                                   "metrics.http another port");
  }
  exposer_->RegisterCollectable(collectable);
  place_ = host_of(address) + ":" + std::to_string(exposer_->GetListeningPorts().at(0));
}

// Design note: the library's thread that takes connections looks whether it shall end when one
// comes, and every 2 s otherwise, twice what the whole daemon has to stop in. So one comes.
MetricsServer::~MetricsServer() {
  const std::jthread knocking([this](const std::stop_token& stop) {
    constexpr std::chrono::milliseconds between{5};
    ClientSocket door("tcp:" + place_);
    for (; !stop.stop_requested(); std::this_thread::sleep_for(between)) {
      door.connect(stop);
      door.close();
    }
  });
  exposer_.reset();
}

}  // namespace splid
