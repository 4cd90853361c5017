#include "daemon/metrics/metrics_server.hpp"

#include <prometheus/exposer.h>

#include <exception>
#include <vector>

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
  url_ = "http://" + host_of(address) + ":" + std::to_string(exposer_->GetListeningPorts().at(0)) +
         "/metrics";
}

MetricsServer::~MetricsServer() = default;

}  // namespace splid
