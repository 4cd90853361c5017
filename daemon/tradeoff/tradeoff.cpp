#include "daemon/tradeoff/tradeoff.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <span>
#include <utility>

#include "daemon/format.hpp"
#include "daemon/tradeoff/tradeoff_score.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/units.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr double m_per_ns_of_delay = speed_of_light_mps / 1e9 / 2;

// Fewer tell nothing, and without a truth a frame needs two on either side.
constexpr std::size_t fewest_frames = 5;

std::optional<double> ratio(const std::optional<double>& rmse, const std::optional<double>& bound) {
  if (!rmse || !bound || !(*bound > 0)) return std::nullopt;
  return *rmse / *bound;
}

// Smallest of the values that at least this share of all does not exceed.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  return values[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
}

// Differences of a clock's readings have digits that mean nothing.
double to_microseconds(double time_ms) { return std::round(time_ms * 1e3) / 1e3; }

struct Measured {
  TradeoffSetting setting;
  std::vector<FrameResult> results;  // a frame each, but after a stop
};

// How much of all is done: frames, weighed by their length.
class Done {
 public:
  Done(const TradeoffEvents& events, double all) : events_(events), all_(all) {}

  void report(const std::string& doing, double more) const {
    events_.progress(doing, std::min(1.0, (done_ + more) / all_));
  }
  void add(double more) { done_ += more; }

 private:
  const TradeoffEvents& events_;
  double all_;
  double done_ = 0;
};

class LengthMeasurement {
 public:
  LengthMeasurement(const Config& config, const FrameOrigin& origin, ThreadClock clock,
                    const TradeoffEvents& events, const std::stop_token& stop)
      : config_(config), origin_(origin), clock_(clock), events_(events), stop_(stop) {}

  // Empty where there are too few frames.
  std::vector<TradeoffRow> rows(double length_ms, std::size_t count, Done& done) {
    count_ = count;
    frames_ = collect_frames(
        config_, origin_, length_ms, count,
        [&](std::size_t n) { done.report(format("making frames of %g ms: %zu", length_ms, n), 0); },
        stop_);
    if (stop_.stop_requested()) return {};
    const auto settings = settings_of_length(config_.estimator, length_ms);
    if (frames_.size() < fewest_frames) {
      events_.warn(format("frames of %g ms are left out: only %zu of them could be had", length_ms,
                          frames_.size()));
      done.add(work(settings.size() * count, length_ms));
      return {};
    }
    std::vector<Measured> measured;
    for (const TradeoffSetting& setting : settings) {
      if (stop_.stop_requested()) break;
      measure(setting, done, measured);
      done.add(work(count, length_ms));
    }
    return judge(measured);
  }

  static double work(std::size_t frames, double length_ms) {
    return static_cast<double>(frames) * length_ms;
  }

 private:
  void measure(const TradeoffSetting& setting, const Done& done, std::vector<Measured>& measured) {
    std::size_t most = 0;
    for (const KeptFrame& frame : frames_) most = std::max(most, frame.photons_ps.size());
    try {
      FrameEstimator estimator(config_.pattern, config_.pulse, config_.scene, setting.estimator,
                               setting.length_ms, most);
      measured.push_back({setting, {}});
      run(estimator, done, measured.back());
    } catch (const Error& error) {
      events_.warn(format("%s, frames of %g ms, is left out: ",
                          setting_name(setting.estimator).c_str(), setting.length_ms) +
                   error.what());
    }
  }

  void run(FrameEstimator& estimator, const Done& done, Measured& measured) {
    const TradeoffSetting& setting = measured.setting;
    const std::string doing =
        format("%s, frames of %g ms", setting_name(setting.estimator).c_str(), setting.length_ms);
    Track track;
    Track* const tracked = setting.estimator.tracked ? &track : nullptr;
    for (const KeptFrame& frame : frames_) {
      if (stop_.stop_requested()) return;
      const FrameView view = frame.view();
      const double begin_ms = clock_();
      const Estimate estimate = estimator.estimate(view, tracked);
      measured.results.push_back(frame_result(estimate, clock_() - begin_ms));
      const std::size_t n = measured.results.size();
      const double part = static_cast<double>(n) / static_cast<double>(frames_.size());
      done.report(doing + format(": %zu of %zu", n, frames_.size()),
                  part * work(count_, setting.length_ms));
    }
  }

  [[nodiscard]] std::vector<TradeoffRow> judge(const std::vector<Measured>& measured) const {
    if (measured.empty()) return {};
    const std::span<const FrameResult> best = measured.front().results;
    const Yardstick unit = make_yardstick(config_, origin_.truth, frames_, best);
    const Reference reference =
        origin_.truth ? truth_reference(frames_) : neighbour_reference(frames_, best, unit);
    std::vector<TradeoffRow> rows;
    for (const Measured& one : measured) {
      const TradeoffRow row = judge(one, score(frames_, one.results, reference, best, unit), unit);
      if (row.frames > 0) rows.push_back(row);
    }
    return rows;
  }

  [[nodiscard]] TradeoffRow judge(const Measured& measured, const Accuracy& accuracy,
                                  const Yardstick& unit) const {
    TradeoffRow row;
    row.setting = measured.setting;
    row.frames = accuracy.frames;
    row.no_value = accuracy.no_value;
    row.compared = accuracy.compared;
    row.wrong_peaks = accuracy.wrong_peaks;
    std::vector<double> times_ms;
    double photons = 0;
    for (std::size_t k = 0; k < measured.results.size(); ++k) {
      if (frames_[k].first) continue;
      times_ms.push_back(measured.results[k].compute_ms);
      photons += static_cast<double>(frames_[k].photons_ps.size());
    }
    row.photons = row.frames > 0 ? photons / static_cast<double>(row.frames) : 0;
    row.p50_ms = to_microseconds(quantile(times_ms, 0.5));
    row.p99_ms = to_microseconds(quantile(times_ms, 0.99));
    if (accuracy.delay_rmse_ns) row.distance_rmse_m = m_per_ns_of_delay * *accuracy.delay_rmse_ns;
    row.velocity_rmse_mps = accuracy.velocity_rmse_mps;
    if (unit.bound.delay_ns > 0) row.distance_bound_m = m_per_ns_of_delay * unit.bound.delay_ns;
    if (unit.bound.velocity_mps > 0) row.velocity_bound_mps = unit.bound.velocity_mps;
    return row;
  }

  const Config& config_;
  const FrameOrigin& origin_;
  ThreadClock clock_;
  const TradeoffEvents& events_;
  const std::stop_token& stop_;
  std::size_t count_ = 0;  // of frames asked for
  std::vector<KeptFrame> frames_;
};

}  // namespace

std::optional<double> TradeoffRow::distance_ratio() const {
  return ratio(distance_rmse_m, distance_bound_m);
}

std::optional<double> TradeoffRow::velocity_ratio() const {
  return ratio(velocity_rmse_mps, velocity_bound_mps);
}

std::string setting_name(const EstimatorOptions& options) {
  if (options.method == Method::paper) return "paper";
  return to_string(options.effort) + std::string(options.tracked ? ", tracked" : "");
}

double thread_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

std::vector<TradeoffSetting> settings_of_length(const EstimatorOptions& configured,
                                                double length_ms) {
  std::vector<TradeoffSetting> settings;
  EstimatorOptions options = configured;
  options.method = Method::search;
  for (const bool tracked : {false, true}) {
    for (const Effort effort : {Effort::exhaustive, Effort::balanced, Effort::fast}) {
      options.effort = effort;
      options.tracked = tracked;
      settings.push_back({options, length_ms});
    }
  }
  options = configured;
  options.method = Method::paper;
  options.tracked = false;
  settings.push_back({options, length_ms});
  return settings;
}

std::vector<TradeoffRow> measure_tradeoff(const Config& config, const FrameOrigin& origin,
                                          const TradeoffPlan& plan, ThreadClock clock,
                                          const TradeoffEvents& events,
                                          const std::stop_token& stop) {
  double all = 0;
  for (const double length_ms : plan.lengths_ms) {
    const auto settings = settings_of_length(config.estimator, length_ms);
    all += LengthMeasurement::work(settings.size() * plan.frames, length_ms);
  }
  Done done(events, all);
  std::vector<TradeoffRow> rows;
  for (const double length_ms : plan.lengths_ms) {
    if (stop.stop_requested()) break;
    LengthMeasurement measurement(config, origin, clock, events, stop);
    const auto more = measurement.rows(length_ms, plan.frames, done);
    rows.insert(rows.end(), more.begin(), more.end());
  }
  if (rows.empty() && !stop.stop_requested()) {
    throw Error(Fault::data, origin.name + ": no frame length has five frames to measure");
  }
  return rows;
}

}  // namespace splid
