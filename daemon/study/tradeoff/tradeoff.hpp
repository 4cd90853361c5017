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
#include "daemon/study/tradeoff/tradeoff_interval.hpp"
#include "estimator/model/options.hpp"

namespace splid::tradeoff {

// The room daemon/study/tradeoff measures what each setting of the estimator costs in processor
// time and gains in accuracy. Read this header first.

// A setting: one way of estimating frames.
struct Setting {
  EstimatorOptions estimator;
  double length_ms = 0;  // of a frame
};

// The cost and the accuracy of a setting, measured on the same frames as the other settings of its
// frame length.
struct Row {
  Setting setting;
  std::size_t frames = 0;       // judged
  double photons = 0;           // mean number in a frame
  double p50_ms = 0;            // one core's time for a frame: median
  double p99_ms = 0;            // and 99 % quantile
  std::size_t no_value = 0;     // frames in which no target was found or whose range is not sure
  std::size_t compared = 0;     // frames compared with the reference
  std::size_t wrong_peaks = 0;  // of the compared frames
  // Root mean square errors at mid-frame, of the frames on no wrong peak, and the Cramer-Rao
  // bounds. The velocity's are absent in a scene at rest. All are absent where no frame could be
  // compared. An error is absent also where it cannot be told from the noise of its reference.
  std::optional<double> distance_rmse_m;
  std::optional<double> velocity_rmse_mps;
  std::optional<double> distance_bound_m;
  std::optional<double> velocity_bound_mps;
  // What holds the true RMSE in 95 of 100 measurements; absent where too few frames tell it.
  std::optional<Interval> distance_interval_m;
  std::optional<Interval> velocity_interval_mps;

  [[nodiscard]] std::optional<double> distance_ratio() const;  // RMSE over bound
  [[nodiscard]] std::optional<double> velocity_ratio() const;
};

struct Plan {
  std::vector<double> lengths_ms;  // ascending
  std::size_t frames = 200;        // for each setting
  bool paper = false;  // measure the method of the paper too, which is some 10 times as slow
};

// The functions called during a measurement, on the caller's thread.
struct Events {
  // Called once, before the first row: how many rows there will be and how long they will take.
  std::function<void(std::size_t rows, double seconds)> reckoned;
  // Called often. doing: what is being done; done_s: time since the first call; left_s: time left,
  // absent before `reckoned` was called.
  std::function<void(const std::string& doing, double done_s, std::optional<double> left_s)>
      progress;
  // Called for each row as soon as it is measured.
  std::function<void(const Row&)> row;
  // Called when all rows of a length are measured, but not after a stop request.
  std::function<void(double length_ms)> length_done;
  Warn warn;
};

// The name of a setting for people: "balanced, tracked", "balanced, no findings".
std::string setting_name(const EstimatorOptions& options);

// The settings of a length, in the order in which they are measured: with both efforts, each frame
// on its own and tracked, and without findings if the configuration has them. The first setting is
// the most thorough; its results stand in for a truth that is not known. paper: includes the method
// of the paper, as the last setting.
std::vector<Setting> settings_of_length(const EstimatorOptions& configured, double length_ms,
                                        bool paper);

// A clock for the time that a frame's estimation takes, in ms, of which other work on the machine
// is no part.
using ThreadClock = double (*)();
double thread_cpu_ms();

struct Clocks {
  ThreadClock thread_ms = thread_cpu_ms;  // for the times in the rows
  const Clock& wall = host_clock();       // for the time that is left
};

// Tries each setting on two frames of each length to reckon how long everything will take, and then
// measures the settings one after the other. The rows are in ascending order of length and, within
// a length, in the order of settings_of_length(). After a stop request, returns the rows measured
// so far, of which the last may be of fewer frames. A setting that the estimator refuses for the
// pattern is left out, with a sentence to `warn`, and so is a length with fewer than five frames.
//
// Threads: the caller's. Errors: those of collect_frames(); Error(Fault::data) where no length has
// five frames.
std::vector<Row> measure(const Config& config, const FrameOrigin& origin, const Plan& plan,
                         const Clocks& clocks, const Events& events, const std::stop_token& stop);

}  // namespace splid::tradeoff
