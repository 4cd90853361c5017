#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/status_reporter.hpp"
#include "daemon/security/refusals.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/source.hpp"
#include "protocol/messages.hpp"

namespace splid {

// What Prometheus is told, by a file and over HTTP as the configuration says.
// docs/reference/metrics.md has each name with its unit and meaning.
//
// Threads: those that take tags never come here: one thread calls, the one that publishes; the
// server's own reads at the same time. Errors: the constructor throws Error(Fault::device) where
// the server's port cannot be had; a file that cannot be written is a notice and nothing else.
class Metrics {
 public:
  // run: whose pattern and mode are told. counters: the source's, whose names tell what there will
  // be. notice: takes a sentence on what is wrong with the file, called from refresh(). refusals:
  // hears who stands in the way of the server, and is told of; null: nobody. It and clock outlive
  // this.
  Metrics(const MetricsOptions& options, const StatusOptions& run,
          const std::vector<SourceCounter>& counters, const Clock& clock,
          std::function<void(const std::string&)> notice, Refusals* refusals = nullptr);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // Where the server answers, a wildcard port resolved; empty where there is none.
  [[nodiscard]] std::string url() const;

  // Who tells how many messages were sent to nobody; before the first refresh().
  void count_dropped(std::function<std::uint64_t()> messages);

  // effort_is_lowered: the frame had less effort than was configured.
  void frame_published(const FrameMessage& message, bool effort_is_lowered);
  // 0 to 1; the highest of a second is shown.
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
  const Refusals* refusals_;
  std::function<std::uint64_t()> dropped_ = [] { return 0; };
  double highest_fill_ = 0;
  std::int64_t next_ns_ = 0;
};

}  // namespace splid
