#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/status_reporter.hpp"
#include "daemon/security/refusals.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/source.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"

namespace splid {

// What Prometheus is told, by a file and over HTTP as the configuration says.
// docs/reference/metrics.md has each name with its unit and meaning.
//
// Threads: the thread that publishes calls; the server's own thread reads at the same time. No
// thread that handles tags comes here. Errors: the constructor throws Error(Fault::device) where
// the server's port cannot be had; a file that cannot be written is a notice and nothing else.
class Metrics {
 public:
  // run: gives the pattern and the mode. counters: the source's; their names become series. notice:
  // takes a sentence on what is wrong with the file, called from refresh(). refusals: hears of
  // connections that stand in the server's way, and its counts become series; null: there are none.
  // refusals and clock outlive the metrics.
  Metrics(const MetricsOptions& options, const StatusOptions& run,
          const std::vector<SourceCounter>& counters, const Clock& clock,
          std::function<void(const std::string&)> notice, security::Refusals* refusals = nullptr);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // Where the server answers, a wildcard port resolved; empty where there is none.
  [[nodiscard]] std::string url() const;

  // messages: tells how many messages were sent to nobody. To be called before the first refresh().
  void count_dropped(std::function<std::uint64_t()> messages);

  // effort_is_lowered: the frame had less effort than was configured.
  void frame_published(const FrameMessage& message, bool effort_is_lowered);
  // ratio: 0 to 1; the highest ratio of a second is shown.
  void ring_filled(double ratio);
  // A second has passed since the last refresh().
  [[nodiscard]] bool due() const;
  // Takes over what is counted elsewhere and writes the file. counters: as in the constructor.
  void refresh(const StatusMessage& status, const StreamCounters& counters);

  // In Prometheus' text format.
  [[nodiscard]] std::string text() const;

 private:
  struct Series;
  struct Outputs;
  const Clock& clock_;
  std::unique_ptr<Series> series_;
  std::unique_ptr<Outputs> outputs_;
  const security::Refusals* refusals_;
  std::function<std::uint64_t()> dropped_ = [] { return 0; };
  double highest_fill_ = 0;
  std::optional<std::int64_t> valid_ns_;  // of the last valid frame
  std::int64_t next_ns_ = 0;
};

}  // namespace splid
