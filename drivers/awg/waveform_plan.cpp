#include "drivers/awg/waveform_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"

namespace splid::awg {
namespace {

constexpr double ps_per_s = 1e12;
constexpr double ps_per_ns = 1e3;

// Design note: more periods in memory can bring pulses nearer to their times, which are within 8 ps
// at 60 GSa/s in any case. As many as an M8195A's internal memory holds take no noticeable time.
constexpr std::int64_t max_samples_of_copies = 262'144;

[[noreturn]] void refuse(const Model& model, const std::string& what) {
  throw Error(Fault::data, std::string("awg ") + model.name + ": " + what);
}

std::string ns_text(double time_ps) {
  // At most three decimals of a nanosecond, without zeros at the end.
  return number_text(std::round(time_ps) / ps_per_ns) + " ns";
}

// The times of all pulses in one pattern period, ascending.
std::vector<double> all_pulse_times_ps(const Pattern& pattern) {
  std::vector<double> times_ps;
  times_ps.reserve(pulses_per_period(pattern));
  double begin_ps = 0;
  for (const PatternSegment& segment : pattern.segments) {
    const std::int64_t repeats = pattern.segments.size() == 1 ? 1 : segment.repeats;
    for (std::int64_t i = 0; i < repeats; ++i, begin_ps += segment.period_ps) {
      for (const double time_ps : segment.pulse_times_ps) times_ps.push_back(begin_ps + time_ps);
    }
  }
  return times_ps;
}

double least_spacing_ps(const Options& options) {
  // A thousandth of a picosecond more is allowed, since doubles do not hold all times exactly.
  return options.min_spacing_ns * ps_per_ns - 1e-3;
}

void check_spacing(const std::vector<double>& times_ps, double period_ps, const Model& model,
                   const Options& options) {
  const double least_ps = least_spacing_ps(options);
  for (std::size_t i = 0; i < times_ps.size(); ++i) {
    const bool is_last = i + 1 == times_ps.size();
    const double next_ps = is_last ? times_ps.front() + period_ps : times_ps[i + 1];
    if (next_ps - times_ps[i] >= least_ps) continue;
    refuse(model, "pulse " + std::to_string(i) + " at " + ns_text(times_ps[i]) + " and pulse " +
                      (is_last ? "0 of the next period" : std::to_string(i + 1)) + " at " +
                      ns_text(next_ps) + " are " + ns_text(next_ps - times_ps[i]) +
                      " apart; awg.min_spacing_ns is " + number_text(options.min_spacing_ns));
  }
}

// The lowest rate worth playing: a pulse has at least two samples, so that its width is within a
// quarter of what was asked for.
double lowest_rate_hz(const Model& model, const Options& options) {
  constexpr double min_pulse_samples = 2;
  const double needed_hz = min_pulse_samples / (options.pulse_width_ns * 1e-9);
  if (needed_hz > model.max_rate_hz) {
    refuse(model, "a pulse of " + number_text(options.pulse_width_ns) +
                      " ns is under two samples; the shortest is " +
                      number_text(min_pulse_samples / model.max_rate_hz * 1e9) + " ns");
  }
  return std::max(model.min_rate_hz, needed_hz);
}

// The repeats of the segments, all cut by the same factor until the whole is within longest_ps.
// Empty where one repeat of each is too long.
std::string fitting_repeats(const Pattern& pattern, double longest_ps) {
  const double part = longest_ps / pattern_period_ps(pattern);
  std::string text;
  double total_ps = 0;
  for (const PatternSegment& segment : pattern.segments) {
    const double repeats = std::max(1.0, std::floor(static_cast<double>(segment.repeats) * part));
    total_ps += repeats * segment.period_ps;
    text += (text.empty() ? "" : ", ") + number_text(repeats);
  }
  return total_ps <= longest_ps ? text : "";
}

void check_memory(const Pattern& pattern, double lowest_hz, const Model& model) {
  const double period_ps = pattern_period_ps(pattern);
  const double longest_ps = static_cast<double>(model.max_samples) / lowest_hz * ps_per_s;
  if (period_ps <= longest_ps) return;
  std::string nearest = "the longest that fits is " + ns_text(std::floor(longest_ps));
  if (pattern.segments.size() > 1) {
    const std::string repeats = fitting_repeats(pattern, longest_ps);
    nearest +=
        repeats.empty() ? "; not even one of each segment does" : ", as with repeats " + repeats;
  }
  refuse(model, "a pattern of " + ns_text(period_ps) + " is " +
                    number_text(std::ceil(period_ps / ps_per_s * lowest_hz)) +
                    " samples at the lowest rate, and the memory holds " +
                    std::to_string(model.max_samples) + "; " + nearest);
}

// The largest deviation of a pulse from its time, ps. The search ends at the first pulse whose
// deviation is not below `best_ps`.
double worst_deviation_ps(const std::vector<double>& times_ps, double sample_ps, double best_ps) {
  double worst_ps = 0;
  for (const double time_ps : times_ps) {
    const double off_ps = std::abs(std::round(time_ps / sample_ps) * sample_ps - time_ps);
    worst_ps = std::max(worst_ps, off_ps);
    if (worst_ps >= best_ps) break;
  }
  return worst_ps;
}

struct Grid {
  std::int64_t samples_per_period = 0;  // 0: none found
  std::int64_t periods = 0;
  double max_deviation_ps = std::numeric_limits<double>::infinity();
};

// Two pulses of which the second follows the first.
struct Pair {
  double first_ps = 0;
  double second_ps = 0;
};

// The pairs of pulses that may be played nearer to each other than allowed, as each pulse lies up
// to half a sample from its time.
class TightPairs {
 public:
  TightPairs(const std::vector<double>& times_ps, double period_ps, double lowest_hz,
             double least_ps)
      : least_ps_(least_ps) {
    const double risky_ps = least_ps + ps_per_s / lowest_hz;
    for (std::size_t i = 0; i < times_ps.size(); ++i) {
      const bool is_last = i + 1 == times_ps.size();
      const Pair pair{times_ps[i], is_last ? times_ps.front() + period_ps : times_ps[i + 1]};
      if (pair.second_ps - pair.first_ps < risky_ps) pairs_.push_back(pair);
    }
  }

  // Whether the pulses are far enough apart when they are played. Takes note of the grid that came
  // nearest to that.
  bool hold(double sample_ps) {
    double apart_ps = std::numeric_limits<double>::infinity();
    Pair nearest;
    for (const Pair& pair : pairs_) {
      const double played_ps =
          (std::round(pair.second_ps / sample_ps) - std::round(pair.first_ps / sample_ps)) *
          sample_ps;
      if (played_ps >= apart_ps) continue;
      apart_ps = played_ps;
      nearest = pair;
      if (apart_ps < missed_apart_ps_) break;
    }
    if (apart_ps >= least_ps_) return true;
    if (apart_ps > missed_apart_ps_) {
      missed_apart_ps_ = apart_ps;
      missed_ = nearest;
    }
    return false;
  }

  // Empty where no grid was missed.
  [[nodiscard]] std::string miss() const {
    if (missed_apart_ps_ == 0) return {};
    return "the pulses at " + ns_text(missed_.first_ps) + " and " + ns_text(missed_.second_ps) +
           " would be played " + number_text(std::round(missed_apart_ps_ * 10) / 10 / ps_per_ns) +
           " ns apart at best, on whole samples; ";
  }

 private:
  double least_ps_;
  std::vector<Pair> pairs_;
  double missed_apart_ps_ = 0;  // of the grid that came nearest
  Pair missed_;
};

// Tries every length of the period at which `copies` periods are whole granules, the highest rate
// first.
void try_copies(std::int64_t copies, const std::vector<double>& times_ps, double period_ps,
                double lowest_hz, const Model& model, TightPairs& tight, Grid& best) {
  // Deviations that differ by less than this differ by rounding only.
  constexpr double same_ps = 1e-3;
  const std::int64_t step = model.granule_samples / copies;
  const std::int64_t most = copies == 1 ? model.max_samples : max_samples_of_copies / copies;
  // 30 ns at 8 GSa/s are 239.99999999999997 samples in doubles, and must be 240.
  constexpr double slack = 1e-12;
  const double longest = period_ps / ps_per_s * model.max_rate_hz * (1 + slack);
  const auto highest =
      static_cast<std::int64_t>(std::min(std::floor(longest), static_cast<double>(most)));
  const double lowest = period_ps / ps_per_s * lowest_hz * (1 - slack);
  for (std::int64_t samples = highest / step * step;
       samples > 0 && static_cast<double>(samples) >= lowest && best.max_deviation_ps > same_ps;
       samples -= step) {
    // Enough periods to reach the shortest waveform.
    const std::int64_t least = model.min_samples;
    const std::int64_t groups =
        std::max<std::int64_t>(1, (least + samples * copies - 1) / (samples * copies));
    const double sample_ps = period_ps / static_cast<double>(samples);
    if (!tight.hold(sample_ps)) continue;
    const double off_ps = worst_deviation_ps(times_ps, sample_ps, best.max_deviation_ps - same_ps);
    if (off_ps >= best.max_deviation_ps - same_ps) continue;
    best = {samples, copies * groups, off_ps};
  }
}

Grid find_grid(const std::vector<double>& times_ps, double period_ps, double lowest_hz,
               const Model& model, const Options& options) {
  TightPairs tight(times_ps, period_ps, lowest_hz, least_spacing_ps(options));
  Grid best;
  for (std::int64_t copies = 1; copies <= model.granule_samples; ++copies) {
    if (model.granule_samples % copies != 0) continue;
    try_copies(copies, times_ps, period_ps, lowest_hz, model, tight, best);
  }
  const std::string miss = tight.miss();
  if (best.samples_per_period == 0 && !miss.empty()) {
    refuse(model, miss + "awg.min_spacing_ns is " + number_text(options.min_spacing_ns) +
                      ": lower it, or move the pulses apart");
  }
  if (best.samples_per_period == 0) {
    refuse(model, "no rate from " + number_text(lowest_hz) + " to " +
                      number_text(model.max_rate_hz) + " Sa/s makes " + ns_text(period_ps) +
                      " a whole number of samples; a larger awg.pulse_width_ns allows lower rates");
  }
  return best;
}

std::int64_t whole_samples(double time_ns, double rate_hz) {
  return std::max<std::int64_t>(1, std::llround(time_ns * 1e-9 * rate_hz));
}

void check_marker(const WaveformPlan& plan, const Model& model) {
  if (plan.samples_per_period - plan.marker_samples >= model.marker_gap_samples) return;
  const auto most = static_cast<double>(plan.samples_per_period - model.marker_gap_samples);
  refuse(model, "the marker leaves less than " + std::to_string(model.marker_gap_samples) +
                    " samples to the next; awg.marker_width_ns must be at most " +
                    number_text(std::floor(std::max(0.0, most) / plan.rate_hz * 1e12) / 1e3));
}

void check_width(const WaveformPlan& plan, const Model& model, const Options& options) {
  for (std::size_t i = 0; i < plan.pulse_starts.size(); ++i) {
    const bool is_last = i + 1 == plan.pulse_starts.size();
    const std::int64_t next =
        is_last ? plan.pulse_starts.front() + plan.samples_per_period : plan.pulse_starts[i + 1];
    if (next - plan.pulse_starts[i] > plan.pulse_samples) continue;
    refuse(model, "pulse " + std::to_string(i) + " of " + number_text(options.pulse_width_ns) +
                      " ns reaches the next; awg.pulse_width_ns must be below " +
                      ns_text(static_cast<double>(next - plan.pulse_starts[i] - 1) / plan.rate_hz *
                              ps_per_s));
  }
}

}  // namespace

WaveformPlan plan_waveform(const Pattern& pattern, const Model& model, const Options& options) {
  const double period_ps = pattern_period_ps(pattern);
  const double lowest_hz = lowest_rate_hz(model, options);
  check_memory(pattern, lowest_hz, model);
  const std::vector<double> times_ps = all_pulse_times_ps(pattern);
  check_spacing(times_ps, period_ps, model, options);
  const Grid grid = find_grid(times_ps, period_ps, lowest_hz, model, options);
  WaveformPlan plan;
  plan.samples_per_period = grid.samples_per_period;
  plan.periods = grid.periods;
  plan.max_deviation_ps = grid.max_deviation_ps;
  plan.rate_hz = std::clamp(static_cast<double>(grid.samples_per_period) / period_ps * ps_per_s,
                            model.min_rate_hz, model.max_rate_hz);
  const double sample_ps = period_ps / static_cast<double>(grid.samples_per_period);
  for (const double time_ps : times_ps) {
    // A pulse that is nearest to the period's end is played at the start of the next period.
    plan.pulse_starts.push_back(std::llround(time_ps / sample_ps) % grid.samples_per_period);
  }
  std::sort(plan.pulse_starts.begin(), plan.pulse_starts.end());
  plan.pulse_samples = whole_samples(options.pulse_width_ns, plan.rate_hz);
  plan.marker_samples = whole_samples(options.marker_width_ns, plan.rate_hz);
  check_width(plan, model, options);
  check_marker(plan, model);
  return plan;
}

std::string in_words(const WaveformPlan& plan) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "%lld samples at %.9g GSa/s, %lld a period; pulses %.4g ns wide, at most %.3g ps "
                "from their times",
                static_cast<long long>(plan.samples()), plan.rate_hz / 1e9,
                static_cast<long long>(plan.samples_per_period),
                static_cast<double>(plan.pulse_samples) / plan.rate_hz * 1e9,
                plan.max_deviation_ps);
  return text.data();
}

Pattern played_pattern(const Pattern& pattern, const WaveformPlan& plan, double rate_hz) {
  Pattern played = pattern;
  played.calibrated_period_ps.reset();
  const double stretch = plan.rate_hz / rate_hz;
  played.unambiguous_delay_ps *= stretch;
  for (double& period_ps : played.subperiods_ps) period_ps *= stretch;
  for (PatternSegment& segment : played.segments) {
    segment.period_ps *= stretch;
    for (double& time_ps : segment.pulse_times_ps) time_ps *= stretch;
  }
  if (played.segments.size() > 1) return played;
  PatternSegment& segment = played.segments.front();
  const double sample_ps = segment.period_ps / static_cast<double>(plan.samples_per_period);
  for (std::size_t i = 0; i < segment.pulse_times_ps.size(); ++i) {
    segment.pulse_times_ps[i] = static_cast<double>(plan.pulse_starts[i]) * sample_ps;
  }
  const double last_sample = pattern.segments.front().pulse_times_ps.back() / sample_ps * stretch;
  if (std::llround(last_sample) == plan.samples_per_period) {
    // The pulse became the first of the next period.
    std::rotate(segment.amplitudes.begin(), segment.amplitudes.end() - 1, segment.amplitudes.end());
  }
  return played;
}

}  // namespace splid::awg
