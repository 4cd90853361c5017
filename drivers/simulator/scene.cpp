#include "drivers/simulator/scene.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "drivers/simulator/array_pixels.hpp"

namespace splid::simulator {
namespace {

DriftRate drift_of(const Options& options) {
  return {options.drift_ppm, options.drift_ramp_ppm_per_s};
}

std::uint64_t seed_of(const Options& options) { return static_cast<std::uint64_t>(options.seed); }

double gap_ps(double rate_per_s) { return rate_per_s > 0 ? ps_per_s / rate_per_s : 0; }

SignalStream first_signal(const Pattern& pattern, const Options& options) {
  const std::optional<Scanner> scanner = options.scanner_in_use();
  if (!scanner) {
    return {pattern, options.detection, drift_of(options),
            TargetPath(options.target, options.tagger_rate()), seed_of(options)};
  }
  std::vector<Sight> pixels;
  for (const ArrayPixel& pixel : array_pixels(options)) {
    pixels.push_back({TargetPath(pixel.scene.target, options.tagger_rate()),
                      pixel.scene.detection.signal_per_pulse});
  }
  return {pattern,           options.detection, drift_of(options),
          std::move(pixels), *scanner,          seed_of(options)};
}

// A fog's random numbers are its own whatever targets there are. A photon meets nothing at 0 m.
constexpr std::uint64_t fog_stream = 1'000'000;
constexpr double nearest_fog_m = 1e-6;

std::vector<SignalStream> signals_of(const Pattern& pattern, const Options& options) {
  std::vector<SignalStream> signals;
  signals.reserve(2 + options.more_targets.size());
  signals.push_back(first_signal(pattern, options));
  for (const FurtherTarget& target : options.more_targets) {
    DetectionOptions detection = options.detection;
    detection.signal_per_pulse = target.signal_per_pulse;
    signals.emplace_back(pattern, detection, drift_of(options),
                         TargetPath(target.path, options.tagger_rate()), seed_of(options),
                         signals.size());
  }
  if (options.fog.counts_per_pulse > 0) {
    DetectionOptions detection = options.detection;
    detection.signal_per_pulse = options.fog.counts_per_pulse;
    detection.fog_m = options.fog.depth_m;
    TargetOptions begin;
    begin.motion = MotionKind::linear;
    begin.distance_m = std::max(options.fog.distance_m, nearest_fog_m);
    signals.emplace_back(pattern, detection, drift_of(options),
                         TargetPath(begin, options.tagger_rate()), seed_of(options), fog_stream);
  }
  return signals;
}

constexpr FineTime never = {PendingTimes::none, 0};

}  // namespace

Scene::Scene(const Pattern& pattern, const Options& options, Part part)
    : signals_(signals_of(pattern, options)),
      foreign_(options.foreign, seed_of(options)),
      sync_(pattern, options.sync, drift_of(options), seed_of(options)),
      has_syncs_(part == Part::all),
      detectors_(options.detector, seed_of(options)),
      random_(seed_of(options), 3),
      start_ps_(options.start_ps),
      photon_input_(static_cast<int>(options.photon_input)),
      near_photons_only_(options.sync.near_photons_only),
      background_gap_ps_(gap_ps(options.background_per_s())),
      background_(background_gap_ps_ > 0 ? FineTime{} : never),
      marker_gap_ps_(gap_ps(options.encoder_rate_hz)),
      marker_(has_syncs_ && marker_gap_ps_ > 0 ? options.encoder_start() : never),
      scanner_(options.scanner_in_use()) {
  if (background_gap_ps_ > 0) next_background();
}

bool Scene::write_until(std::int64_t until_ps, TagWriter& out) {
  for (SignalStream& signal : signals_) signal.fill(until_ps);
  foreign_.fill(until_ps);
  if (has_syncs_) sync_.fill(until_ps);
  for (;;) {
    const std::int64_t first_ps =
        std::min({next_signal().front(), sync_.pending().front(), next_marker_ps(),
                  detectors_.next_release_ps(), next_late_ps(), until_ps});
    if (!write_background(first_ps, out)) return false;
    // The background has trapped a carrier, or one of its photons is late.
    if (std::min(detectors_.next_release_ps(), next_late_ps()) < first_ps) continue;
    if (first_ps >= until_ps) return true;
    if (!write_first(out)) return false;
  }
}

// The hot loop of a scene with much background.
bool Scene::write_background(std::int64_t until_ps, TagWriter& out) {
  while (background_.ps < std::min({until_ps, detectors_.next_release_ps(), next_late_ps()})) {
    if (!put_light(background_.ps, out)) return false;
    next_background();
  }
  return true;
}

// Writes the earliest event of afterpulses, late photons, signal, syncs and markers.
bool Scene::write_first(TagWriter& out) {
  PendingTimes& signal = next_signal();
  const std::int64_t signal_ps = signal.front();
  const std::int64_t sync_ps = sync_.pending().front();
  const std::int64_t marker_ps = next_marker_ps();
  const std::int64_t release_ps = detectors_.next_release_ps();
  if (next_late_ps() <= std::min({release_ps, signal_ps, sync_ps, marker_ps})) return put_late(out);
  if (release_ps <= std::min({signal_ps, sync_ps, marker_ps})) {
    return put_detection(release_ps, detectors_.take_release(), out);
  }
  if (signal_ps <= std::min(sync_ps, marker_ps)) {
    signal.pop();
    return put_light(signal_ps, out);
  }
  if (sync_ps <= marker_ps) {
    sync_.pending().pop();
    return put_sync(sync_ps, out);
  }
  return put_marker(out);
}

std::int64_t Scene::next_marker_ps() const {
  const std::int64_t encoder_ps = marker_.rounded_ps();
  return scanner_ ? std::min(encoder_ps, scanner_->next_marker().time_ps) : encoder_ps;
}

bool Scene::put_marker(TagWriter& out) {
  const std::int64_t encoder_ps = marker_.rounded_ps();
  if (encoder_ps == next_marker_ps()) {
    marker_.advance_far(marker_gap_ps_);
    return out.put(marker_tag(start_ps_ + encoder_ps, 1));
  }
  const Scanner::Marker marker = scanner_->next_marker();
  scanner_->take_marker();
  return out.put(marker_tag(start_ps_ + marker.time_ps, marker.bits));
}

bool Scene::put_light(std::int64_t time_ps, TagWriter& out) {
  return put_detection(time_ps, detectors_.detect(time_ps), out);
}

bool Scene::put_detection(std::int64_t time_ps, std::optional<Detection> detection,
                          TagWriter& out) {
  if (!detection) return true;
  if (detection->late_ps == 0) return put_photon(time_ps, detection->detector, out);
  late_.push_back({time_ps + detection->late_ps, detection->detector});
  std::push_heap(late_.begin(), late_.end(), is_later);
  return true;
}

bool Scene::put_late(TagWriter& out) {
  std::pop_heap(late_.begin(), late_.end(), is_later);
  const LatePhoton photon = late_.back();
  late_.pop_back();
  return put_photon(photon.time_ps, photon.detector, out);
}

bool Scene::put_photon(std::int64_t time_ps, int detector, TagWriter& out) {
  photon_since_sync_ = true;
  return out.put(photon_tag(start_ps_ + time_ps, photon_input_ + detector));
}

bool Scene::put_sync(std::int64_t time_ps, TagWriter& out) {
  const bool passed = photon_since_sync_ || !near_photons_only_;
  photon_since_sync_ = false;
  return !passed || out.put(sync_tag(start_ps_ + time_ps));
}

// The light that comes next, of all targets and foreign sources.
PendingTimes& Scene::next_signal() {
  PendingTimes* next = &signals_.front().pending();
  for (std::size_t k = 1; k < signals_.size(); ++k) {
    PendingTimes& other = signals_[k].pending();
    if (other.front() < next->front()) next = &other;
  }
  return foreign_.pending().front() < next->front() ? foreign_.pending() : *next;
}

void Scene::next_background() {
  background_.advance_far(background_gap_ps_ * random_.exponential());
}

}  // namespace splid::simulator
