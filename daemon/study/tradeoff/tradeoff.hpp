#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/study/tradeoff/tradeoff_frames.hpp"
#include "estimator/model/options.hpp"

namespace splid {

// One way of estimating frames.
struct TradeoffSetting {
  EstimatorOptions estimator;
  double length_ms = 0;  // of a frame
};

// What a setting costs and what it is worth, measured on the same frames as the others of its
// length.
struct TradeoffRow {
  TradeoffSetting setting;
  std::size_t frames = 0;  // judged
  double photons = 0;      // mean a frame
  double p50_ms = 0;       // one core's time a frame
  double p99_ms = 0;
  std::size_t no_value = 0;     // frames: no target found, or its range not sure
  std::size_t compared = 0;     // with the reference
  std::size_t wrong_peaks = 0;  // of those
  // Root mean square errors at mid-frame of frames on no wrong peak, and the bounds of Cramer and
  // Rao. Absent where there is none: of velocity in a scene at rest, of all where no frame could be
  // compared, and an error where too few could be to find it above the noise of their reference.
  std::optional<double> distance_rmse_m;
  std::optional<double> velocity_rmse_mps;
  std::optional<double> distance_bound_m;
  std::optional<double> velocity_bound_mps;

  [[nodiscard]] std::optional<double> distance_ratio() const;  // RMSE over bound
  [[nodiscard]] std::optional<double> velocity_ratio() const;
};

struct TradeoffPlan {
  std::vector<double> lengths_ms;  // ascending
  std::size_t frames = 200;        // a setting
  bool paper = false;              // the method of the paper too, a hundred times as slow
};

// What is told while it is measured, on the caller's thread.
struct TradeoffEvents {
  // Once, before the first row: how many rows there will be and how long they will take.
  std::function<void(std::size_t rows, double seconds)> reckoned;
  // What is being done; done_s: since the first call; left_s: absent until reckoned. Called often.
  std::function<void(const std::string& doing, double done_s, std::optional<double> left_s)>
      progress;
  // A row, as soon as it is measured.
  std::function<void(const TradeoffRow&)> row;
  // All rows of a length are measured; not after a stop.
  std::function<void(double length_ms)> length_done;
  Warn warn;
};

// For people: "balanced, tracked".
std::string setting_name(const EstimatorOptions& options);

// The settings of a length, in the order in which they are measured; the first is the most
// thorough, which stands in for a truth that is not known. paper: its method too, last.
std::vector<TradeoffSetting> settings_of_length(const EstimatorOptions& configured,
                                                double length_ms, bool paper);

// Time that a frame's estimation took, whatever else the machine does; ms.
using ThreadClock = double (*)();
double thread_cpu_ms();

struct TradeoffClocks {
  ThreadClock thread_ms = thread_cpu_ms;  // of the rows
  const Clock& wall = host_clock();       // of what is left
};

// Tries each setting on two frames of each length, to reckon how long it all takes, then measures
// them one after the other: rows ascending in length and, within one, in the order of
// settings_of_length(). After a stop request the rows measured so far, the last of them maybe of
// fewer frames. A setting that the estimator refuses for the pattern is left out, with its reason
// to `warn`; so is a length for which fewer than five frames come.
//
// Threads: the caller's. Errors: those of collect_frames(); Error(Fault::data) where no length has
// five frames.
std::vector<TradeoffRow> measure_tradeoff(const Config& config, const FrameOrigin& origin,
                                          const TradeoffPlan& plan, const TradeoffClocks& clocks,
                                          const TradeoffEvents& events,
                                          const std::stop_token& stop);

}  // namespace splid
