#include "daemon/study/calibration/pattern_calibration.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "daemon/stream/channel_map.hpp"
#include "daemon/stream/frame.hpp"
#include "daemon/stream/frame_plan.hpp"
#include "daemon/stream/framer.hpp"
#include "daemon/stream/framer_sink.hpp"
#include "daemon/stream/sync_diagnosis.hpp"
#include "drivers/replay/replay.hpp"
#include "estimator/calibration/pulse_finder.hpp"
#include "estimator/calibration/side_lobes.hpp"
#include "estimator/model/units.hpp"
#include "protocol/error.hpp"

namespace splid::calibration {
namespace {

constexpr double m_per_ps =
    speed_of_light_mps * 1e-12 / 2;  // metres of distance for a picosecond of delay
constexpr double mm_per_m = 1e3;

// Passes each frame on and reuses its memory for the next frame.
class FrameByFrame final : public FrameSink {
 public:
  FrameByFrame(const FrameCapacity& capacity, std::function<void(const Frame&)> take)
      : frame_(capacity), take_(std::move(take)) {}
  Frame& open() override { return frame_; }
  void close() override { take_(frame_); }

 private:
  Frame frame_;
  std::function<void(const Frame&)> take_;
};

struct Seen {
  FramerTotals totals;
  std::optional<SyncDiagnosis> diagnosis;
};

// The channels with one pixel alone.
ChannelOptions channels_of_pixel(const Config& config, std::size_t pixel) {
  ChannelOptions channels = config.channels;
  channels.pixels = {config.pixels[pixel].input};
  channels.delays_ps = {config.pixels[pixel].delay_ps};
  return channels;
}

// Reads the whole recording each time that read() is called.
class Reader {
 public:
  Reader(const Config& config, const OpenRecording& open, const Plan& plan,
         const TellProgress& progress, const std::stop_token& stop)
      : config_(config),
        channels_(config.pixels.empty() ? config.channels : channels_of_pixel(config, 0)),
        open_(open),
        plan_(plan),
        progress_(progress),
        stop_(stop) {}

  Seen read(const char* doing, const std::function<void(const FrameView&)>& take) const {
    return read(doing, channels_, take);
  }
  Seen read(const char* doing, const ChannelOptions& inputs,
            const std::function<void(const FrameView&)>& take) const {
    return read_frames(doing, inputs, [&](const Frame& frame) { take(frame.view()); });
  }
  Seen read_frames(const char* doing, const ChannelOptions& inputs,
                   const std::function<void(const Frame&)>& take) const {
    const auto ring_tags = static_cast<std::size_t>(config_.pipeline.ring_capacity_tags);
    const double length_ms = config_.frame.length_ms;
    double seconds = 0;
    const std::size_t pixels = std::max<std::size_t>(inputs.pixels.size(), 1);
    FrameByFrame frames(frame_capacity(length_ms, config_.pattern, ring_tags, false, pixels),
                        [&](const Frame& frame) {
                          take(frame);
                          seconds += static_cast<double>(frame.end_ps - frame.start_ps) * 1e-12;
                          progress_(doing, seconds);
                        });
    const ChannelMap channels(inputs);
    Framer framer(
        framer_options(length_ms, config_.pattern, config_.drift.method, config_.detector.walk),
        channels, frames);
    FramerSink sink(framer, stop_);
    open_()->run(sink, stop_);
    framer.finish();
    if (stop_.stop_requested()) {
      throw Error(Fault::usage, plan_.recording + ": stopped before it was read to its end");
    }
    return {framer.totals(), framer.diagnosis()};
  }

 private:
  const Config& config_;
  const ChannelOptions channels_;  // that the pattern comes from
  const OpenRecording& open_;
  const Plan& plan_;
  const TellProgress& progress_;
  const std::stop_token& stop_;
};

void check_distance(const Plan& plan) {
  if (!plan.distance_m || std::abs(*plan.distance_m) <= farthest_target_m) return;
  throw Error(Fault::usage,
              fmt::format("the target's distance, {:g} m, must be from {:.9g} to {:.9g} m",
                          *plan.distance_m, -farthest_target_m, farthest_target_m));
}

[[noreturn]] void refuse(const Plan& plan, const std::string& why) {
  throw Error(Fault::data, plan.recording + ": " + why);
}

std::string why_nothing_folds(const Seen& seen) {
  if (seen.diagnosis) return in_words(*seen.diagnosis);
  return "no frame has both syncs that agree and photons (" + grouped(seen.totals.photons) +
         " photons, " + grouped(seen.totals.syncs) +
         " syncs); see channels.photon and channels.sync";
}

std::string velocity(double ps_per_s, double std_ps_per_s) {
  return fmt::format("v = {:+.4g} +- {:.2g} mm/s", ps_per_s * m_per_ps * mm_per_m,
                     std_ps_per_s * m_per_ps * mm_per_m);
}

void check_smear(const Plan& plan, const TargetMotion& track) {
  const auto motion = track.motion();
  if (!motion) return;
  refuse(plan, "the target moves: its delay changes by " +
                   fmt::format("{:.3g} ns", motion->moved_ps / 1e3) + " (" +
                   velocity(motion->delay_rate_ps_per_s, motion->std_delay_rate_ps_per_s) +
                   " on average), which widens all pulses by as much; record a target at rest");
}

constexpr double photons_slack = 1.01;  // of the signal above all photons, by the fit's rounding
constexpr double longest_recording_s = 1e5;

void check_photons(const Plan& plan, const Calibration& found) {
  const auto photons = static_cast<double>(found.photons);
  if (!(found.signal_photons <= photons_slack * photons)) {
    refuse(plan, "no pulses fit its " + grouped(found.photons) +
                     " photons; see pulse.sigma_ps, the width of a detected pulse in ps, and the "
                     "pattern's period");
  }
  const double factor = photons_wanted(found, plan.goal);
  if (factor <= 1) return;
  const std::string goal = fmt::format("what is asked for, {:g} ps and {:g} % of a pulse",
                                       plan.goal.std_time_ps, 100 * plan.goal.std_amplitude);
  const std::string signal =
      "too few photons: " + grouped(static_cast<std::uint64_t>(found.signal_photons)) +
      " signal photons determine the worst pulse ";
  const double more_s = found.seconds * (factor - 1);
  if (!(more_s < longest_recording_s)) {
    refuse(plan, signal + "to far less than " + goal +
                     "; record with more light, or ask for less with --time-ps and "
                     "--amplitude-percent");
  }
  refuse(plan,
         signal + fmt::format("to {:.3g} times ", std::sqrt(factor)) + goal + "; it needs " +
             grouped(static_cast<std::uint64_t>(std::ceil(found.signal_photons * (factor - 1)))) +
             fmt::format(" more signal photons, {:.3g} s more at this rate; or ask for less with "
                         "--time-ps and --amplitude-percent",
                         more_s));
}

// Design note: a motion that is statistically significant need not matter. A target that moved by
// less than the goal for the pulse times is accepted, and the report mentions its motion.
void check_rest(const Plan& plan, const RestReport& rest) {
  const std::string allowed =
      fmt::format(" where {:g} ps are allowed (--time-ps)", plan.goal.std_time_ps);
  if (rest.moves() && std::abs(rest.walk_ps()) > plan.goal.std_time_ps) {
    refuse(plan,
           "the target moves, " + velocity(rest.delay_rate_ps_per_s, rest.std_delay_rate_ps_per_s) +
               fmt::format(": {:.3g} ps of delay in {:.3g} s,", rest.walk_ps(), rest.seconds) +
               allowed +
               "; record a target at rest, or for a shorter time if it is the "
               "electronics that drift");
  }
  if (rest.wanders() && rest.wander_ps > plan.goal.std_time_ps) {
    refuse(plan, "the target moves to and fro: its delay wanders by " +
                     fmt::format("{:.3g} ps rms ({:.3g} mm, {:.3g} standard deviations more than "
                                 "the photons' noise),",
                                 rest.wander_ps, rest.wander_ps * m_per_ps * mm_per_m,
                                 rest.wander_deviations) +
                     allowed + "; record a target at rest");
  }
}

CalibrationFacts facts_of(const Plan& plan, const Calibration& found) {
  CalibrationFacts facts;
  facts.recording = plan.recording;
  facts.seconds = found.seconds;
  facts.photons = found.photons;
  facts.signal_photons = found.signal_photons;
  facts.std_period_ps = found.std_period_ps;
  facts.std_density = found.std_density;
  facts.distance_m = plan.distance_m;
  return facts;
}

// The pulses at the times when they left the laser, in a clock in which the pattern takes
// period_ps: without the delay to the target.
std::vector<CalibratedPulse> emitted(const Calibration& found, double period_ps, double delay_ps) {
  std::vector<CalibratedPulse> pulses = found.pulses;
  const double per_tagger_ps = period_ps / found.period_ps;
  for (CalibratedPulse& pulse : pulses) {
    const double time_ps = pulse.time_ps * per_tagger_ps - delay_ps;
    pulse.time_ps = time_ps - period_ps * std::floor(time_ps / period_ps);
    // A time that is 0 except for rounding.
    if (pulse.time_ps >= period_ps) pulse.time_ps = 0;
  }
  std::sort(pulses.begin(), pulses.end(), [](const CalibratedPulse& a, const CalibratedPulse& b) {
    return a.time_ps < b.time_ps;
  });
  return pulses;
}

// The pulses of a pattern whose segment has its period.
void fill_pulses(const Calibration& found, double delay_ps, Pattern& pattern) {
  PatternSegment& segment = pattern.segments.front();
  CalibrationFacts& facts = *pattern.calibration;
  for (auto* values : {&segment.pulse_times_ps, &segment.amplitudes, &facts.std_pulse_times_ps,
                       &facts.std_amplitudes}) {
    values->clear();
  }
  for (const CalibratedPulse& pulse : emitted(found, segment.period_ps, delay_ps)) {
    segment.pulse_times_ps.push_back(pulse.time_ps);
    segment.amplitudes.push_back(pulse.amplitude);
    facts.std_pulse_times_ps.push_back(pulse.std_time_ps);
    facts.std_amplitudes.push_back(pulse.std_amplitude);
  }
}

Pattern pattern_of(const Config& config, const Plan& plan, const Calibration& found) {
  Pattern pattern = config.pattern;
  PatternSegment& segment = pattern.segments.front();
  if (found.pulses.size() != segment.pulse_times_ps.size()) {
    pattern.mode = found.pulses.size() == 1 ? Mode::baseline : Mode::random;
    pattern.subperiods_ps.clear();
  }
  // In the pattern's own clock its period is the nominal one, whatever the tagger counts.
  const double nominal_ps = pattern_period_ps(config.pattern);
  const double period_ps =
      config.drift.reference == ClockReference::pattern ? nominal_ps : found.period_ps;
  // The subperiods become parts of that period.
  for (double& subperiod_ps : pattern.subperiods_ps) subperiod_ps *= period_ps / nominal_ps;
  if (pattern.mode != Mode::ambiguous) pattern.unambiguous_delay_ps = period_ps;
  segment = {period_ps, {}, {}, 0};
  pattern.calibrated_period_ps = found.period_ps;
  pattern.pulse = found.shape;
  pattern.calibration = facts_of(plan, found);
  fill_pulses(found, 0, pattern);
  return pattern;
}

// Where the target is to be measured: at its distance, or else in the middle of the range, where
// noise does not wrap it.
double delay_to_target_ps(const Config& config, const Plan& plan, const Pattern& pattern) {
  if (!plan.distance_m) return pattern.unambiguous_delay_ps / 2;
  return (*plan.distance_m + config.scene.range_offset_m) / m_per_ps;
}

// For evenly or nearly evenly spaced pulses: sets the mode ambiguous, with the range that the light
// of a frame leaves.
void judge_range(const Config& config, const Calibration& found, Pattern& pattern) {
  if (pattern.mode == Mode::ambiguous) return;
  const std::size_t alike = ranges_alike(found, config.frame.length_ms * 1e-3);
  if (alike == 1) return;
  pattern.mode = Mode::ambiguous;
  pattern.subperiods_ps.clear();
  pattern.unambiguous_delay_ps /= static_cast<double>(alike);
}

// Calibrates from the photons of one input alone.
std::optional<Calibration> calibrate_input(const Config& config, const Reader& reader,
                                           std::size_t input) {
  ChannelOptions channels = config.channels;
  channels.photon.assign(1, config.channels.photon[input]);
  if (!channels.delays_ps.empty()) channels.delays_ps = {config.channels.delays_ps[input]};
  PhaseHistogram fold(pattern_period_ps(config.pattern), config.pulse.sigma_ps);
  const std::string doing = "folded input " + channels.photon.front();
  reader.read(doing.c_str(), channels, [&](const FrameView& frame) { fold.add(frame); });
  return fold.photons() == 0 ? std::nullopt : calibrate(fold, config.pulse.sigma_ps);
}

PixelReport report_pixel(const Config& config, const Reader& reader, const Calibration& first,
                         std::size_t pixel) {
  const PixelOptions& options = config.pixels[pixel];
  PixelReport report{options.name, false, 0, 0, 0, 0};
  PhaseHistogram fold(pattern_period_ps(config.pattern), config.pulse.sigma_ps);
  double seen_s = 0;
  const std::string doing = "folded pixel " + options.name;
  reader.read(doing.c_str(), channels_of_pixel(config, pixel), [&](const FrameView& frame) {
    fold.add(frame);
    seen_s += frame.seen_ns() * 1e-9;
  });
  if (seen_s > 0) report.background_per_s = static_cast<double>(fold.photons()) / seen_s;
  const auto own =
      fold.photons() > 0 ? calibrate(fold, config.pulse.sigma_ps) : std::optional<Calibration>{};
  const auto shift = own ? shift_between(first, *own) : std::nullopt;
  if (!shift) return report;
  report.has_pulses = true;
  report.delay_ps = options.delay_ps + shift->shift_ps;
  report.std_delay_ps = pixel == 0 ? 0 : shift->std_ps;
  report.width_ps = own->width_ps;
  report.background_per_s = own->background_per_ps * own->period_ps / own->seconds;
  return report;
}

std::vector<PixelReport> report_pixels(const Config& config, const Reader& reader,
                                       const Calibration& first) {
  std::vector<PixelReport> reports;
  if (config.pixels.size() < 2) return reports;
  for (std::size_t i = 0; i < config.pixels.size(); ++i) {
    reports.push_back(report_pixel(config, reader, first, i));
  }
  return reports;
}

std::vector<Crosstalk> find_crosstalk(const Config& config, const Reader& reader,
                                      const Calibration& first,
                                      const std::vector<PixelReport>& pixels) {
  if (pixels.empty()) return {};
  std::vector<double> late_ps;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    late_ps.push_back(pixels[i].has_pulses ? pixels[i].delay_ps - config.pixels[i].delay_ps : 0);
  }
  CrosstalkCount count(first.period_ps, std::move(late_ps));
  reader.read_frames("looked for crosstalk", config.channels,
                     [&](const Frame& frame) { count.add(frame); });
  return count.significant();
}

std::vector<InputDelay> compare_inputs(const Config& config, const Reader& reader) {
  const std::vector<std::string>& names = config.channels.photon;
  if (names.size() < 2 || !config.pixels.empty()) return {};
  const auto first = calibrate_input(config, reader, 0);
  if (!first) return {};
  const auto delay_of = [&](std::size_t input) {
    return config.channels.delays_ps.empty() ? 0 : config.channels.delays_ps[input];
  };
  std::vector<InputDelay> inputs{{names[0], delay_of(0), {}}};
  for (std::size_t i = 1; i < names.size(); ++i) {
    const auto other = calibrate_input(config, reader, i);
    const auto shift = other ? shift_between(*first, *other) : std::nullopt;
    if (!shift) return {};
    inputs.push_back({names[i], delay_of(i), *shift});
  }
  return inputs;
}

void check_one_segment(const Config& config) {
  if (config.pattern.segments.size() == 1) return;
  throw Error(Fault::usage,
              config.pattern_file + ": has several segments; patterns of one can be calibrated");
}

// How many times wider or narrower than configured pulses may be for their number to be right.
constexpr double most_wider = 3;
constexpr double most_narrower = 8;
constexpr double narrower = 2;  // where no pulse stands out

[[noreturn]] void refuse_width(const Config& config, const Plan& plan, double found_ps) {
  const double ratio = found_ps / config.pulse.sigma_ps;
  refuse(plan, fmt::format("its pulses are {:.2g} times {} than configured; set pulse.sigma_ps of "
                           "{} to {:.2g} and repeat",
                           std::max(ratio, 1 / ratio), ratio > 1 ? "wider" : "narrower",
                           config.file, found_ps));
}

Calibration find_calibration(const Config& config, const Plan& plan, const PhaseHistogram& fold) {
  const double width_ps = config.pulse.sigma_ps;
  const double shown_ps = width_by_pairs_ps(fold).value_or(width_ps);
  if (shown_ps > most_wider * width_ps || shown_ps * most_narrower < width_ps) {
    refuse_width(config, plan, shown_ps);
  }
  std::optional<Calibration> found = calibrate(fold, width_ps);
  if (found) return std::move(*found);
  if (shown_ps * narrower < width_ps) refuse_width(config, plan, shown_ps);
  refuse(plan, "no pulse stands out of the " + grouped(fold.photons()) + " photons folded on " +
                   fmt::format("{:.6g}", fold.period().period_ps) +
                   " ps; record a target at rest, closer or for longer");
}

}  // namespace

PatternCalibration calibrate_pattern(const Config& config, const OpenRecording& open,
                                     const Plan& plan, const TellProgress& progress,
                                     const std::stop_token& stop) {
  check_one_segment(config);
  check_distance(plan);
  const Reader reader(config, open, plan, progress, stop);
  const double nominal_ps = pattern_period_ps(config.pattern);
  const double width_ps = config.pulse.sigma_ps;
  PhaseHistogram fold(nominal_ps, width_ps);
  TargetMotion track(nominal_ps, width_ps);
  const Seen seen = reader.read("folded", [&](const FrameView& frame) {
    fold.add(frame);
    track.add(frame);
  });
  if (fold.photons() == 0) refuse(plan, why_nothing_folds(seen));
  check_smear(plan, track);
  Calibration found = find_calibration(config, plan, fold);
  check_photons(plan, found);
  RestCheck check(fold, found);
  reader.read("checked for motion", [&](const FrameView& frame) { check.add(frame); });
  const RestReport rest = check.report();
  check_rest(plan, rest);
  Pattern pattern = pattern_of(config, plan, found);
  judge_range(config, found, pattern);
  const double delay_ps = delay_to_target_ps(config, plan, pattern);
  fill_pulses(found, delay_ps, pattern);
  if (const auto fault = validate(pattern)) {
    refuse(plan, "the pulses that were found are no pattern: " + *fault);
  }
  std::vector<InputDelay> inputs = compare_inputs(config, reader);
  std::vector<PixelReport> pixels = report_pixels(config, reader, found);
  std::vector<Crosstalk> crosstalk = find_crosstalk(config, reader, found, pixels);
  const double target_m = delay_ps * m_per_ps - config.scene.range_offset_m;
  return {std::move(pattern), target_m,          std::move(found),  rest,
          std::move(fold),    std::move(inputs), std::move(pixels), std::move(crosstalk)};
}

PatternCalibration calibrate_recording(const Config& config, const std::string& file,
                                       const Plan& plan, const TellProgress& progress,
                                       const std::stop_token& stop) {
  SourceContext context;
  context.pattern = &config.pattern;
  context.pixels = config.pixels;
  context.warn = [](const std::string& sentence) { log_warning(sentence); };
  ReplayOptions replay;
  replay.recording = file;
  if (replay.open(context)->info().syncs_are_counted) {
    throw Error(Fault::data,
                file +
                    ": is in T3 mode, which counts syncs and does not time them: the "
                    "pattern's period cannot be calibrated. Record a target at rest in "
                    "T2 mode");
  }
  return calibrate_pattern(
      config, [&] { return replay.open(context); }, plan, progress, stop);
}

}  // namespace splid::calibration
