#pragma once

#include <memory>
#include <string>

namespace prometheus {
class Collectable;
class Exposer;
}  // namespace prometheus

namespace splid {

// Answers GET /metrics over HTTP.
//
// Threads: two of its own answer, one more takes connections, whatever comes in; a request that
// stays unfinished holds one of them for a second. The destructor waits for them: some
// milliseconds, or until such a request's second is over. Errors: the constructor throws
// Error(Fault::device).
class MetricsServer {
 public:
  // address: HOST:PORT, the port "*" is the system's choice.
  MetricsServer(const std::string& address,
                const std::shared_ptr<prometheus::Collectable>& collectable);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  // As bound.
  [[nodiscard]] std::string url() const { return "http://" + place_ + "/metrics"; }

 private:
  std::unique_ptr<prometheus::Exposer> exposer_;
  std::string place_;  // HOST:PORT
};

}  // namespace splid
