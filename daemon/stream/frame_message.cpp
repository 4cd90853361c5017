#include "daemon/stream/frame_message.hpp"

#include <algorithm>
#include <string_view>

#include "estimator/checks/finding.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double ns_in_a_second = 1e9;
constexpr double ps_in_a_ms = 1e9;
constexpr double m_per_ns_of_delay = speed_of_light_mps / ns_in_a_second / 2;

// Chance that a signal photon goes unseen because the detector is dead from an earlier one.
//
// Design note: at 0.1 the signal flux reads a tenth low, and since of several photons of a pulse
// the first is kept, the pulse's centre is early by S / 2 * sigma / sqrt(pi) = 0.03 sigma: 3 ps or
// 0.4 mm for sigma = 100 ps, as much as the noise of a good 50 ms frame (0.6 mm).
constexpr double max_dead_time_chance = 0.1;

// Of a bright signal less is too much: the same limit as that of DeadTimeCheck. The distance is
// then off by at most as many of its own deviations.
constexpr double most_deviations = 0.5;

// Design note: four photons of background have a deviation of two, and a ratio to them one of 50 %.
// With fewer photons the ratio says nothing, and without background it would be made of the
// likelihood's rounding: 1e15.
constexpr double least_background_deviations = 2;

// Where no photon speaks for background, the likelihood is highest at b = 0 and falls as exp(-b t):
// b comes out as the search's rounding instead of 0, and its deviation is 1 / t.
constexpr double no_background_deviations = 1e-6;

double seen_ns(const Frame& frame) {
  return static_cast<double>(frame.end_ps - frame.start_ps) * ns_per_ps * frame.seen_fraction;
}

// Where the dead time is modelled, the values hold in ever more light, but depend ever more on
// the dead time's own value: with x would-be detections in a dead time, an error of 1 % in it is
// one of x % in the light.
//
// Design note: docs/evidence/data/dead-time.csv has the errors up to these limits.
constexpr double most_in_a_dead_time = 10;
constexpr double most_in_a_pulse = 10;

bool is_low_by_split(const Estimate& estimate) {
  return estimate.has_values && estimate.low_by_split * estimate.signal_per_pulse >
                                    most_deviations * estimate.std_signal_per_pulse;
}

bool is_saturated(const Frame& frame, const Estimate& estimate, const FrameContext& context) {
  const double in_a_pulse =
      estimate.has_values ? estimate.signal_per_pulse * context.mean_amplitude : 0;
  if (estimate.dead_time_modelled) {
    return is_beyond_model(estimate.blind_fraction, in_a_pulse) || is_low_by_split(estimate);
  }
  const double seen = seen_ns(frame);
  if (!(context.dead_time_ns > 0) || !(seen > 0)) return false;
  const double photons_per_ns = static_cast<double>(frame.photons_ps.size()) / seen;
  if (photons_per_ns * context.dead_time_ns + in_a_pulse > max_dead_time_chance) return true;
  // It was to be modelled: what the model would have mended is too much.
  if (!context.models_dead_time || !(in_a_pulse > 0)) return false;
  // Of a pulse's photons half are behind another, on average, where there are few.
  const double lost = (photons_per_ns * context.dead_time_ns + in_a_pulse / 2) / context.inputs;
  return lost * estimate.signal_per_pulse > most_deviations * estimate.std_signal_per_pulse;
}

FrameStatus status_of(const Frame& frame, const Estimate& estimate, const FrameContext& context) {
  if (estimate.status == FrameStatus::no_sync) return FrameStatus::no_sync;
  if (frame.seen_fraction < context.min_seen_fraction) return FrameStatus::incomplete;
  if (is_saturated(frame, estimate, context)) return FrameStatus::saturated;
  // A stop left no time for it.
  if (estimate.status == FrameStatus::not_run) return FrameStatus::incomplete;
  return estimate.status;
}

void add_target(FrameMessage& message, const Estimate& estimate, const FrameContext& context) {
  message.distance_m = m_per_ns_of_delay * estimate.delay_ns - context.range_offset_m;
  message.std_distance_m = m_per_ns_of_delay * estimate.std_delay_ns;
  message.velocity_mps = estimate.velocity_mps;
  // A target that is taken to be at rest has a velocity of zero, and no deviation of the velocity.
  if (estimate.std_velocity_mps > 0) message.std_velocity_mps = estimate.std_velocity_mps;
  if (estimate.std_acceleration_mps2 > 0) {
    message.acceleration_mps2 = estimate.acceleration_mps2;
    message.std_acceleration_mps2 = estimate.std_acceleration_mps2;
  }
  message.signal_per_pulse = estimate.signal_per_pulse;
  message.std_signal_per_pulse = estimate.std_signal_per_pulse;
  message.signal_per_period = estimate.signal_per_pulse * context.amplitude_per_period;
  message.delay_ns = estimate.delay_start_ns;
  if (estimate.std_pulse_sigma_ns > 0) {
    message.pulse_sigma_ps = estimate.pulse_sigma_ns / ns_per_ps;
    message.std_pulse_sigma_ps = estimate.std_pulse_sigma_ns / ns_per_ps;
  }
  message.range_odds_nats = estimate.range_odds_nats;
  const double background_per_s = *message.background_per_s;
  if (background_per_s > 0 &&
      background_per_s >= least_background_deviations * *message.std_background_per_s) {
    message.sbr = *message.signal_per_period / *message.background_per_period;
  }
}

FrameMessage::Target target_message(const TargetEstimate& estimate, const FrameContext& context) {
  FrameMessage::Target target;
  target.status = estimate.status;
  target.distance_m = m_per_ns_of_delay * estimate.delay_ns - context.range_offset_m;
  target.std_distance_m = m_per_ns_of_delay * estimate.std_delay_ns;
  target.velocity_mps = estimate.velocity_mps;
  if (estimate.std_velocity_mps > 0) target.std_velocity_mps = estimate.std_velocity_mps;
  target.signal_per_pulse = estimate.signal_per_pulse;
  target.std_signal_per_pulse = estimate.std_signal_per_pulse;
  target.signal_per_period = estimate.signal_per_pulse * context.amplitude_per_period;
  target.delay_ns = estimate.delay_start_ns;
  target.significance = estimate.significance_nats;
  target.range_odds_nats = estimate.range_odds_nats;
  target.findings = to_message(estimate.findings);
  return target;
}

void list_targets(FrameMessage& message, const Estimate& estimate, const FrameContext& context) {
  message.targets.emplace();
  if (!message.distance_m) return;
  if (estimate.target_count == 0) {
    message.targets->push_back(target_message(estimate.first_target(), context));
  }
  for (std::size_t k = 0; k < estimate.target_count; ++k) {
    message.targets->push_back(target_message(estimate.targets.at(k), context));
  }
}

void add_background(FrameMessage& message, const Frame& frame, const Estimate& estimate,
                    const FrameContext& context) {
  const double period_ps = frame.sync.locked ? frame.sync.period_ps : context.period_ps;
  const bool is_none =
      estimate.has_values &&
      estimate.background_per_ns < no_background_deviations * estimate.std_background_per_ns;
  const double background_per_ns = is_none ? 0 : estimate.background_per_ns;
  message.background_per_s = background_per_ns * ns_in_a_second;
  message.background_per_period = background_per_ns * period_ps * ns_per_ps;
  if (estimate.has_values) {
    message.std_background_per_s = estimate.std_background_per_ns * ns_in_a_second;
  }
  if (estimate.dead_time_modelled) message.blind_fraction = estimate.blind_fraction;
  if (estimate.status != FrameStatus::no_sync) message.significance = estimate.significance_nats;
}

// Absent where both are.
std::optional<double> sum_of(const std::optional<double>& a, const std::optional<double>& b) {
  return a && b ? *a + *b : a ? a : b;
}

FrameMessage::Sync sync_message(const SyncFit& fit) {
  FrameMessage::Sync sync{fit.count, fit.missing, fit.spurious, {}, {}, {}};
  if (fit.locked) {
    sync.period_ps = fit.period_ps;
    sync.drift_ppm = fit.drift_ppm;
    sync.jitter_ps = fit.jitter_ps;
  }
  return sync;
}

FrameMessage::Scan scan_message(const ScanPlace& place, const FrameContext& context) {
  FrameMessage::Scan scan;
  scan.picture = static_cast<std::uint64_t>(place.picture);
  scan.line = static_cast<std::uint64_t>(place.line);
  scan.column = static_cast<std::uint64_t>(place.column);
  ScanDirection looks;
  if (context.directions) {
    looks = context.directions->of(place);
    if (!looks.azimuth_deg && !looks.elevation_deg) return scan;
  }
  scan.azimuth_deg = sum_of(context.azimuth_deg, looks.azimuth_deg);
  scan.elevation_deg = sum_of(context.elevation_deg, looks.elevation_deg);
  return scan;
}

}  // namespace

bool is_beyond_model(double blind_fraction, double in_a_pulse) {
  const double in_a_dead_time = blind_fraction / (1 - blind_fraction);
  return !(in_a_dead_time <= most_in_a_dead_time) || in_a_pulse > most_in_a_pulse;
}

FrameContext frame_context(const Config& config) {
  FrameContext context;
  context.mode = config.pattern.mode;
  context.range_offset_m = config.scene.range_offset_m;
  context.min_seen_fraction = config.frame.min_seen_fraction;
  context.dead_time_ns = config.detector.dead_time_ns;
  context.models_dead_time = config.detector.dead_time == DeadTime::modelled;
  context.inputs = static_cast<double>(std::max<std::size_t>(config.channels.photon.size(), 1));
  context.lists_targets = config.scene.targets > 1;
  context.period_ps = pattern_period_ps(config.pattern);
  context.amplitude_per_period = amplitude_per_period(config.pattern);
  context.mean_amplitude = mean_amplitude(config.pattern);
  if (config.scan.has_directions()) {
    context.directions = std::make_shared<ScanDirections>(config.scan);
  }
  if (config.pixels.size() == 1) {
    context.azimuth_deg = config.pixels[0].azimuth_deg;
    context.elevation_deg = config.pixels[0].elevation_deg;
  }
  return context;
}

FrameMessage make_frame_message(const Frame& frame, const Estimate& estimate,
                                const FrameContext& context, const FrameTiming& times) {
  FrameMessage message;
  message.timestamp_s = times.mid_unix_s;
  message.sequence = frame.sequence;
  message.status = status_of(frame, estimate, context);
  message.mode = context.mode;
  message.start_ps = frame.start_ps;
  message.duration_ms = static_cast<double>(frame.end_ps - frame.start_ps) / ps_in_a_ms;
  message.photons = frame.photons_ps.size();
  message.lost_tags = frame.lost_tags;
  message.uncounted_losses = frame.uncounted_losses;
  message.seen_fraction = frame.seen_fraction;
  if (!context.syncs_are_counted) message.sync = sync_message(frame.sync);
  if (frame.scan) message.scan = scan_message(*frame.scan, context);
  message.effort = to_string(times.effort);
  message.compute_ms = times.compute_ms;
  if (times.latency_ms >= 0) message.latency_ms = times.latency_ms;
  if (estimate.status != FrameStatus::not_run) {
    add_background(message, frame, estimate, context);
  }
  message.findings = to_message(estimate.findings);
  const bool has_target =
      estimate.status == FrameStatus::ok || estimate.status == FrameStatus::ambiguous;
  if (has_target && estimate.has_values) add_target(message, estimate, context);
  if (context.lists_targets) list_targets(message, estimate, context);
  return message;
}

std::string unmodelled_by(const Config& config) {
  if (!(config.detector.dead_time_ns > 0) || config.detector.dead_time != DeadTime::modelled) {
    return "";
  }
  return config.estimator.method == Method::paper ? "estimator.method paper" : "";
}

std::vector<FrameMessage::Finding> to_message(const FoundList& found) {
  std::vector<FrameMessage::Finding> findings;
  for (const Finding& finding : found.all()) {
    const checks::FindingRow& row = checks::row_of(finding.name);
    findings.push_back({checks::to_string(finding.name), finding.value, finding.std, row.unit,
                        finding.gain_nats, row.advice});
  }
  return findings;
}

const FrameMessage::Finding* pattern_finding(const FrameMessage& message) {
  if (message.status != FrameStatus::no_target) return nullptr;
  const std::string_view name = checks::to_string(FindingName::wrong_pattern);
  const auto found = std::find_if(message.findings.begin(), message.findings.end(),
                                  [&](const auto& finding) { return finding.name == name; });
  return found == message.findings.end() ? nullptr : &*found;
}

}  // namespace splid
