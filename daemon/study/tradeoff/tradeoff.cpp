#include "daemon/study/tradeoff/tradeoff.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <span>
#include <utility>

#include "daemon/base/time_left.hpp"
#include "daemon/study/tradeoff/tradeoff_score.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "protocol/error.hpp"

namespace splid::tradeoff {
namespace {

constexpr double m_per_ns_of_delay = speed_of_light_mps / 1e9 / 2;

// Fewer frames tell nothing; and where no truth is known, each frame needs two frames on either
// side.
constexpr std::size_t fewest_frames = 5;

std::optional<double> ratio(const std::optional<double>& rmse, const std::optional<double>& bound) {
  if (!rmse || !bound || !(*bound > 0)) return std::nullopt;
  return *rmse / *bound;
}

// The smallest of the values that at least this share of all values does not exceed.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  return values[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
}

std::optional<Interval> times(const std::optional<Interval>& factors,
                              const std::optional<double>& value) {
  if (!factors || !value) return std::nullopt;
  return Interval{factors->low * *value, factors->high * *value};
}

// Rounds away the last digits of a difference of clock readings, which mean nothing.
double to_microseconds(double time_ms) { return std::round(time_ms * 1e3) / 1e3; }

struct Measured {
  Setting setting;
  std::vector<FrameResult> results;  // one for each frame; fewer after a stop request
};

// The work for a frame length, and how long it is expected to take by a trial. The times are of the
// thread, which other work on the machine changes less than the wall clock's.
struct LengthWork {
  double length_ms = 0;
  double making_s = 0;  // to make all frames
  std::vector<Setting> settings;
  std::vector<double> setting_s;  // for each setting, to estimate all frames
};

// The arguments of a measurement, which all its parts need.
struct Context {
  const Config& config;
  const FrameOrigin& origin;
  const Plan& plan;
  const Clocks& clocks;
  const Events& events;
  const std::stop_token& stop;

  [[nodiscard]] double now_s() const { return static_cast<double>(clocks.wall.steady_ns()) / 1e9; }
  [[nodiscard]] double thread_s() const { return clocks.thread_ms() / 1e3; }
};

// Reports how far the work is.
class Teller {
 public:
  explicit Teller(const Context& context)
      : context_(context), begin_s_(context.now_s()), thread_begin_s_(context.thread_s()) {}

  // To be called when the trials are over. From the trials it takes how much longer the wall
  // clock's time is than the thread's.
  void expect(const std::vector<LengthWork>& works) {
    const double thread_s = context_.thread_s() - thread_begin_s_;
    const double share = thread_s > 0 ? (context_.now_s() - begin_s_) / thread_s : 1;
    std::size_t rows = 0;
    for (const LengthWork& work : works) {
      left_.expect(share * work.making_s);
      for (const double seconds : work.setting_s) left_.expect(share * seconds);
      rows += work.settings.size();
    }
    context_.events.reckoned(rows, left_.left_s(0, 0));
    begin_part();
  }
  void tell(const std::string& doing) const {
    context_.events.progress(doing, context_.now_s() - begin_s_, std::nullopt);
  }
  // part: how much of the current part is done, 0 to 1.
  void tell(const std::string& doing, double part) const {
    const double now_s = context_.now_s();
    context_.events.progress(doing, now_s - begin_s_, left_.left_s(part, now_s - part_begin_s_));
  }
  void finish_part() {
    left_.finish(context_.now_s() - part_begin_s_);
    begin_part();
  }
  void leave_out_part() { left_.finish(0); }

 private:
  void begin_part() { part_begin_s_ = context_.now_s(); }

  const Context& context_;
  double begin_s_;
  double thread_begin_s_;
  double part_begin_s_ = 0;
  TimeLeft left_;
};

std::string name_of(const Setting& setting) {
  return fmt::format("{}, frames of {:g} ms", setting_name(setting.estimator), setting.length_ms);
}

std::size_t most_photons(const std::vector<KeptFrame>& frames) {
  std::size_t most = 0;
  for (const KeptFrame& frame : frames) most = std::max(most, frame.photons_ps.size());
  return most;
}

// Estimates frames one after the other with a setting, which may ask for tracking.
class Estimation {
 public:
  // Errors: those of FrameEstimator's constructor.
  Estimation(const Context& context, const Setting& setting, std::size_t max_photons)
      : clock_(context.clocks.thread_ms),
        estimator_(context.config.pattern, context.config.pulse, context.config.scene,
                   setting.estimator, setting.length_ms, max_photons,
                   context.config.drift.reference, context.config.detector,
                   context.config.channels.photon.size()),
        tracked_(setting.estimator.tracked),
        range_risk_(setting.estimator.range_risk) {}

  FrameResult result(const KeptFrame& frame) {
    const FrameView view = frame.view();
    const double begin_ms = clock_();
    const Estimate estimate = estimator_.estimate(view, tracked_ ? &track_ : nullptr);
    const double took_ms = clock_() - begin_ms;
    return frame_result(estimate, range_risk_, took_ms);
  }

 private:
  ThreadClock clock_;
  FrameEstimator estimator_;
  bool tracked_;
  double range_risk_;
  TargetTrack track_;
};

// Tries the work for a frame length on a few frames.
class Trial {
 public:
  Trial(const Context& context, double length_ms)
      : context_(context), work_{length_ms, 0, {}, {}} {}

  // Returns work without settings where not even the frames for the trial could be made.
  LengthWork work(const Teller& teller) {
    teller.tell(fmt::format("trying frames of {:g} ms", work_.length_ms));
    make_frames();
    if (frames_.size() < 2) return work_;
    for (const Setting& setting :
         settings_of_length(context_.config.estimator, work_.length_ms, context_.plan.paper)) {
      if (context_.stop.stop_requested()) break;
      teller.tell("trying " + name_of(setting));
      try {
        work_.setting_s.push_back(setting_s(setting));
        work_.settings.push_back(setting);
      } catch (const Error& error) {
        context_.events.warn(name_of(setting) + ", is left out: " + error.what());
      }
    }
    return work_;
  }

 private:
  static constexpr std::size_t tried = 2;  // frames tried after the first frame
  // A frame that takes this long to estimate is enough for the trial.
  static constexpr double long_frame_s = 0.1;

  // A scene gives as many frames as are asked for; how many a recording has is known only after
  // reading it.
  void make_frames() {
    const bool endless = context_.origin.scene.has_value();
    const double begin_s = context_.thread_s();
    std::optional<double> first_s;
    frames_ = collect_frames(
        context_.config, context_.origin, work_.length_ms, endless ? tried : context_.plan.frames,
        [&](std::size_t) {
          if (!first_s) first_s = context_.thread_s();
        },
        context_.stop);
    if (frames_.size() < 2) return;
    const std::size_t made = frames_.size() - 1;
    count_ = endless ? context_.plan.frames : made;
    // The time before the first frame is needed once; the time between frames for each frame.
    work_.making_s = *first_s - begin_s + of_all(context_.thread_s() - *first_s, made);
    frames_.resize(std::min(frames_.size(), 1 + tried));
  }

  [[nodiscard]] double of_all(double seconds, std::size_t frames) const {
    return seconds * static_cast<double>(count_) / static_cast<double>(frames);
  }

  // The first frame warms up the caches; its time counts only if it is long.
  [[nodiscard]] double setting_s(const Setting& setting) const {
    Estimation estimation(context_, setting, most_photons(frames_));
    double begin_s = context_.thread_s();
    estimation.result(frames_.front());
    const double first_s = context_.thread_s() - begin_s;
    if (first_s > long_frame_s) return of_all(first_s, 1);
    begin_s = context_.thread_s();
    for (std::size_t k = 1; k < frames_.size(); ++k) estimation.result(frames_[k]);
    return of_all(context_.thread_s() - begin_s, frames_.size() - 1);
  }

  const Context& context_;
  LengthWork work_;
  std::size_t count_ = 0;  // frames that will be measured
  std::vector<KeptFrame> frames_;
};

class LengthMeasurement {
 public:
  LengthMeasurement(const Context& context, Teller& teller) : context_(context), teller_(teller) {}

  // Reports each row when it is measured. Returns false where there are too few frames.
  bool measure(const LengthWork& work, std::vector<Row>& rows) {
    make_frames(work.length_ms);
    if (context_.stop.stop_requested()) return false;
    if (frames_.size() < fewest_frames) {
      context_.events.warn(
          fmt::format("frames of {:g} ms are left out: only {} of them could be had",
                      work.length_ms, frames_.size()));
      for (std::size_t k = 0; k < work.settings.size(); ++k) teller_.leave_out_part();
      return false;
    }
    for (const Setting& setting : work.settings) {
      if (context_.stop.stop_requested()) break;
      const Measured measured = estimate(setting);
      if (rows_ == 0) take_yardstick(measured.results);
      const Accuracy accuracy = score(frames_, measured.results, reference_, best_, unit_);
      if (accuracy.frames > 0) rows.push_back(judge(measured, accuracy, unit_));
      if (accuracy.frames > 0) context_.events.row(rows.back());
      ++rows_;
      teller_.finish_part();
    }
    return !context_.stop.stop_requested();
  }

 private:
  void make_frames(double length_ms) {
    const std::size_t count = context_.plan.frames;
    frames_ = collect_frames(
        context_.config, context_.origin, length_ms, count,
        [&](std::size_t n) {
          teller_.tell(fmt::format("making frames of {:g} ms: {} of {}", length_ms, n, count),
                       static_cast<double>(n) / static_cast<double>(count));
        },
        context_.stop);
    teller_.finish_part();
  }

  [[nodiscard]] Measured estimate(const Setting& setting) const {
    Measured measured{setting, {}};
    const std::string doing = name_of(setting);
    Estimation estimation(context_, setting, most_photons(frames_));
    for (const KeptFrame& frame : frames_) {
      if (context_.stop.stop_requested()) break;
      measured.results.push_back(estimation.result(frame));
      const std::size_t n = measured.results.size();
      teller_.tell(doing + fmt::format(": {} of {}", n, frames_.size()),
                   static_cast<double>(n) / static_cast<double>(frames_.size()));
    }
    return measured;
  }

  // best: the results of the most thorough setting, which is measured first.
  void take_yardstick(const std::vector<FrameResult>& best) {
    best_ = best;
    unit_ = make_yardstick(context_.config, context_.origin.truth, frames_, best_);
    reference_ = context_.origin.truth ? truth_reference(frames_)
                                       : neighbour_reference(frames_, best_, unit_);
  }

  [[nodiscard]] Row judge(const Measured& measured, const Accuracy& accuracy,
                          const Yardstick& unit) const {
    Row row;
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
    // Where the differences are no larger than the noise of their reference, the error is not
    // known; it is not 0.
    if (accuracy.delay_rmse_ns.value_or(0) > 0) {
      row.distance_rmse_m = m_per_ns_of_delay * *accuracy.delay_rmse_ns;
    }
    if (accuracy.velocity_rmse_mps.value_or(0) > 0) {
      row.velocity_rmse_mps = accuracy.velocity_rmse_mps;
    }
    row.distance_interval_m = times(accuracy.delay_interval, row.distance_rmse_m);
    row.velocity_interval_mps = times(accuracy.velocity_interval, row.velocity_rmse_mps);
    if (unit.bound.delay_ns > 0) row.distance_bound_m = m_per_ns_of_delay * unit.bound.delay_ns;
    if (unit.bound.velocity_mps > 0) row.velocity_bound_mps = unit.bound.velocity_mps;
    return row;
  }

  const Context& context_;
  Teller& teller_;
  std::vector<KeptFrame> frames_;
  std::vector<FrameResult> best_;
  Yardstick unit_;
  Reference reference_;
  std::size_t rows_ = 0;
};

}  // namespace

std::optional<double> Row::distance_ratio() const {
  return ratio(distance_rmse_m, distance_bound_m);
}

std::optional<double> Row::velocity_ratio() const {
  return ratio(velocity_rmse_mps, velocity_bound_mps);
}

std::string setting_name(const EstimatorOptions& options) {
  if (options.method == Method::paper) return "paper";
  return to_string(options.effort) + std::string(options.tracked ? ", tracked" : "") +
         (options.findings == FindingsWanted::off ? ", no findings" : "");
}

double thread_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

std::vector<Setting> settings_of_length(const EstimatorOptions& configured, double length_ms,
                                        bool paper) {
  std::vector<Setting> settings;
  EstimatorOptions options = configured;
  options.method = Method::search;
  for (const bool tracked : {false, true}) {
    for (const Effort effort : {Effort::balanced, Effort::fast}) {
      options.effort = effort;
      options.tracked = tracked;
      settings.push_back({options, length_ms});
    }
  }
  if (configured.findings == FindingsWanted::on) {
    options = settings.front().estimator;
    options.findings = FindingsWanted::off;
    settings.push_back({options, length_ms});
  }
  if (!paper) return settings;
  options = configured;
  options.method = Method::paper;
  options.tracked = false;
  settings.push_back({options, length_ms});
  return settings;
}

std::vector<Row> measure(const Config& config, const FrameOrigin& origin, const Plan& plan,
                         const Clocks& clocks, const Events& events, const std::stop_token& stop) {
  const Context context{config, origin, plan, clocks, events, stop};
  Teller teller(context);
  std::vector<LengthWork> works;
  for (const double length_ms : plan.lengths_ms) {
    works.push_back(Trial(context, length_ms).work(teller));
    if (stop.stop_requested()) return {};
  }
  teller.expect(works);
  std::vector<Row> rows;
  for (const LengthWork& work : works) {
    if (LengthMeasurement(context, teller).measure(work, rows)) events.length_done(work.length_ms);
    if (stop.stop_requested()) break;
  }
  if (rows.empty() && !stop.stop_requested()) {
    throw Error(Fault::data, origin.name + ": no frame length has five frames to measure");
  }
  return rows;
}

}  // namespace splid::tradeoff
