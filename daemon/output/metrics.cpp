#include "daemon/output/metrics.hpp"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>

#include "daemon/output/metrics_file.hpp"
#include "daemon/output/metrics_server.hpp"

namespace splid {
namespace {

using prometheus::Counter;
using prometheus::Gauge;
using prometheus::Histogram;
using prometheus::Labels;
using prometheus::Registry;

constexpr std::int64_t refresh_interval_ns = 1'000'000'000;
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

// A frame of 50 ms is to be out before the next is full; an estimate takes 1 ms or so, and 30 ms
// of a million photons.
const Histogram::BucketBoundaries latency_bounds_s = {0.001, 0.002, 0.005, 0.01, 0.02,
                                                      0.05,  0.1,   0.2,   0.5,  1};
const Histogram::BucketBoundaries compute_bounds_s = {0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01,
                                                      0.02,   0.05,   0.1,   0.2,   0.5,   1};

// A family that is asked for again by its name, with another label, is the same family.
Counter& counter(Registry& registry, const std::string& name, const std::string& help,
                 const Labels& labels = {}) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add(labels);
}

Gauge& gauge(Registry& registry, const char* name, const char* help, const Labels& labels = {}) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add(labels);
}

Histogram& histogram(Registry& registry, const char* name, const char* help,
                     const Histogram::BucketBoundaries& bounds_s) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry).Add({}, bounds_s);
}

// One gauge for each enumerator; the gauge of the present state is 1, all others are 0.
template <class State, std::size_t N>
std::array<Gauge*, N> states(Registry& registry, const char* name, const char* help) {
  std::array<Gauge*, N> all{};
  for (std::size_t i = 0; i < N; ++i) {
    all[i] = &gauge(registry, name, help, {{"state", to_string(static_cast<State>(i))}});
  }
  return all;
}

constexpr std::array<const char*, 9> measurements = {
    "ok",        "no_target",     "ambiguous", "incomplete", "no_sync",
    "saturated", "wrong_pattern", "no_signal", "none"};

std::array<Gauge*, measurements.size()> gauges_of_measurement(Registry& registry) {
  std::array<Gauge*, measurements.size()> all{};
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i] = &gauge(registry, "splid_measurement", "1 for the measurement of the status, else 0",
                    {{"state", measurements[i]}});
  }
  return all;
}

void show_measurement(const std::array<Gauge*, measurements.size()>& all,
                      const std::string& measurement) {
  for (std::size_t i = 0; i < all.size(); ++i) all[i]->Set(measurement == measurements[i] ? 1 : 0);
}

template <class State, std::size_t N>
void show(const std::array<Gauge*, N>& all, State state) {
  for (std::size_t i = 0; i < N; ++i) all[i]->Set(static_cast<std::size_t>(state) == i ? 1 : 0);
}

std::array<Counter*, 7> frames_by_status(Registry& registry) {
  std::array<Counter*, 7> all{};
  for (std::size_t i = 1; i < all.size(); ++i) {  // 0 is not_run, which is never published
    all[i] = &counter(registry, "splid_frames_total", "Frames published, by their status",
                      {{"status", to_string(static_cast<FrameStatus>(i))}});
  }
  return all;
}

Counter& tags(Registry& registry, const char* channel) {
  return counter(
      registry, "splid_tags_total",
      "Tags in frames by channel; ignored: on channels that are not configured; outside: in "
      "no dwell of a scan",
      {{"channel", channel}});
}

Counter& lost(Registry& registry, const char* cause) {
  return counter(registry, "splid_tags_lost_total",
                 "Lost tags, where their number is known, by cause", {{"cause", cause}});
}

Counter& let_go(Registry& registry, security::Refusal reason) {
  return counter(registry, "splid_connections_dropped_total",
                 "Connections cut off. crowd: too many of a peer; flood: it sent too much",
                 {{"reason", to_string(reason)}});
}

void raise(Counter& shown, std::uint64_t total) {
  const double more = static_cast<double>(total) - shown.Value();
  if (more > 0) shown.Increment(more);
}

}  // namespace

struct Metrics::Series {
  Series(const StatusOptions& run, const std::vector<SourceCounter>& counters, double now_unix_s) {
    gauge(*registry, "splid_build_info", "1; the labels name what runs",
          {{"version", SPLID_VERSION},
           {"pattern", std::filesystem::path(run.pattern_file).stem().string()},
           {"mode", to_string(run.mode)}})
        .Set(1);
    gauge(*registry, "process_start_time_seconds", "When splid started, UTC").Set(now_unix_s);
    for (const SourceCounter& source : counters) {
      drivers.push_back(&counter(*registry, source.name, source.help, source.labels));
    }
    show(state, DaemonState::starting);
    show_measurement(measurement, "none");
    show_values({});
    age.Set(unknown);
    show(device, DeviceState::connected);
  }

  void show_values(const FrameMessage& valid) const {
    const auto set = [](Gauge& shown, const std::optional<double>& value) {
      shown.Set(value.value_or(unknown));
    };
    set(distance, valid.distance_m);
    set(distance_std, valid.std_distance_m);
    set(velocity, valid.velocity_mps);
    set(velocity_std, valid.std_velocity_mps);
    set(signal, valid.signal_per_pulse);
    set(signal_std, valid.std_signal_per_pulse);
    set(background, valid.background_per_s);
    set(background_std, valid.std_background_per_s);
  }

  std::shared_ptr<Registry> registry = std::make_shared<Registry>();

  Gauge& distance = gauge(*registry, "splid_distance_meters", "Distance of the last valid frame");
  Gauge& distance_std =
      gauge(*registry, "splid_distance_std_meters", "Standard deviation of that distance");
  Gauge& velocity = gauge(*registry, "splid_velocity_meters_per_second",
                          "Velocity of the last valid frame, positive away from the lidar");
  Gauge& velocity_std = gauge(*registry, "splid_velocity_std_meters_per_second",
                              "Standard deviation of that velocity");
  Gauge& signal = gauge(*registry, "splid_signal_counts_per_pulse",
                        "Signal of the last valid frame, for a pulse of amplitude 1");
  Gauge& signal_std =
      gauge(*registry, "splid_signal_std_counts_per_pulse", "Standard deviation of that signal");
  Gauge& background =
      gauge(*registry, "splid_background_counts_per_second", "Background of the last valid frame");
  Gauge& background_std = gauge(*registry, "splid_background_std_counts_per_second",
                                "Standard deviation of that background");
  Gauge& age = gauge(*registry, "splid_valid_frame_age_seconds",
                     "Time since the last valid frame was published");

  std::array<Counter*, 7> frames = frames_by_status(*registry);
  Counter& lowered = counter(*registry, "splid_frames_effort_lowered_total",
                             "Frames estimated with less effort than configured");
  Histogram& latency =
      histogram(*registry, "splid_frame_latency_seconds",
                "From the arrival of a frame's last tag to its publication", latency_bounds_s);
  Histogram& compute = histogram(*registry, "splid_frame_compute_seconds",
                                 "Estimation of a frame on its thread", compute_bounds_s);

  Counter& read =
      counter(*registry, "splid_tags_read_total", "Photons, syncs and markers taken from the ring");
  Counter& photons = tags(*registry, "photon");
  Counter& syncs = tags(*registry, "sync");
  Counter& markers = tags(*registry, "encoder");
  Counter& ignored = tags(*registry, "ignored");
  Counter& outside = tags(*registry, "outside");
  Counter& shared = counter(*registry, "splid_tags_shared_total",
                            "Further uses of a record with several marker bits");
  Counter& instrument = lost(*registry, "instrument");
  Counter& ring = lost(*registry, "ring");
  Counter& late = lost(*registry, "late");
  Counter& surplus = lost(*registry, "surplus");
  Counter& discarded = lost(*registry, "discarded");
  Counter& uncounted =
      counter(*registry, "splid_losses_uncounted_total", "Losses of an unknown number of tags");
  Counter& jumps = counter(*registry, "splid_stream_jumps_total",
                           "Gaps so long that no frames were made for them");
  Counter& resets =
      counter(*registry, "splid_stream_resets_total", "Times the tagger's clock was set anew");
  Gauge& ring_fill = gauge(*registry, "splid_ring_fill_ratio",
                           "Highest fill of the ring in the last second, 0 to 1");

  Counter& missing =
      counter(*registry, "splid_syncs_missing_total", "Pattern periods without a sync");
  Counter& spurious =
      counter(*registry, "splid_syncs_spurious_total", "Syncs that fit no pattern period");
  Gauge& drift =
      gauge(*registry, "splid_sync_drift_ratio",
            "Pattern period of the last frame divided by the calibrated period, minus 1");
  Gauge& jitter =
      gauge(*registry, "splid_sync_jitter_seconds",
            "Root mean square of the syncs' offsets from evenly spaced times, last frame");

  std::array<Gauge*, 5> state =
      states<DaemonState, 5>(*registry, "splid_state", "1 for the state of the status, else 0");
  std::array<Gauge*, measurements.size()> measurement = gauges_of_measurement(*registry);
  std::array<Gauge*, 3> device = states<DeviceState, 3>(
      *registry, "splid_device_state", "1 for the state of the instrument, else 0");
  Counter& refused = counter(*registry, "splid_connections_refused_total",
                             "Connections without an allowed key, or with a bad handshake");
  Counter& crowd = let_go(*registry, security::Refusal::crowd);
  Counter& flood = let_go(*registry, security::Refusal::flood);
  Counter& unsent = counter(*registry, "splid_messages_dropped_total",
                            "Messages dropped, since sending did not keep up");
  std::vector<Counter*> drivers;  // in the order of TagSource::counters()
};

struct Metrics::Outputs {
  std::optional<MetricsFile> file;
  std::optional<MetricsServer> server;
};

Metrics::Metrics(const MetricsOptions& options, const StatusOptions& run,
                 const std::vector<SourceCounter>& counters, const Clock& clock,
                 std::function<void(const std::string&)> notice, security::Refusals* refusals)
    : clock_(clock),
      series_(std::make_unique<Series>(run, counters, clock.unix_s())),
      outputs_(std::make_unique<Outputs>()),
      refusals_(refusals) {
  series_->drift.Set(unknown);
  series_->jitter.Set(unknown);
  if (!options.file.empty()) outputs_->file.emplace(options.file, std::move(notice));
  if (!options.http.empty()) {
    outputs_->server.emplace(
        options.http, [this] { return text(); }, refusals, clock);
  }
}

Metrics::~Metrics() = default;

std::string Metrics::url() const { return outputs_->server ? outputs_->server->url() : ""; }

void Metrics::count_dropped(std::function<std::uint64_t()> messages) {
  dropped_ = std::move(messages);
}

void Metrics::frame_published(const FrameMessage& message, bool effort_is_lowered) {
  Series& series = *series_;
  series.frames.at(static_cast<std::size_t>(message.status))->Increment();
  if (effort_is_lowered) series.lowered.Increment();
  if (message.valid()) {
    series.show_values(message);
    valid_ns_ = clock_.steady_ns();
  }
  if (message.latency_ms) series.latency.Observe(*message.latency_ms * 1e-3);
  if (message.compute_ms) series.compute.Observe(*message.compute_ms * 1e-3);
  const FrameMessage::Sync sync = message.sync.value_or(FrameMessage::Sync{});
  series.missing.Increment(static_cast<double>(sync.missing));
  series.spurious.Increment(static_cast<double>(sync.spurious));
  series.drift.Set(sync.drift_ppm ? *sync.drift_ppm * 1e-6 : unknown);
  series.jitter.Set(sync.jitter_ps ? *sync.jitter_ps * 1e-12 : unknown);
}

void Metrics::ring_filled(double ratio) { highest_fill_ = std::max(highest_fill_, ratio); }

bool Metrics::due() const { return clock_.steady_ns() >= next_ns_; }

void Metrics::refresh(const StatusMessage& status, const StreamCounters& counters) {
  next_ns_ = clock_.steady_ns() + refresh_interval_ns;
  Series& series = *series_;
  const FramerTotals& framer = counters.framer;
  raise(series.read, framer.events);
  raise(series.photons, framer.photons);
  raise(series.syncs, framer.syncs);
  raise(series.markers, framer.markers);
  raise(series.ignored, framer.ignored);
  raise(series.outside, framer.outside);
  raise(series.shared, framer.shared);
  raise(series.late, framer.late);
  raise(series.surplus, framer.surplus);
  raise(series.ring, counters.dropped_tags);
  // What the ring dropped is counted at once and comes down the stream later.
  raise(series.instrument, framer.reported - std::min(framer.reported, counters.dropped_tags));
  raise(series.discarded, counters.discarded_tags);
  raise(series.uncounted, framer.uncounted);
  raise(series.jumps, framer.jumps);
  raise(series.resets, framer.resets);
  raise(series.unsent, dropped_());
  if (refusals_ != nullptr) {
    raise(series.refused, refusals_->kept_out());
    raise(series.crowd, refusals_->count(security::Refusal::crowd));
    raise(series.flood, refusals_->count(security::Refusal::flood));
  }
  series.ring_fill.Set(std::exchange(highest_fill_, 0));
  show(series.state, status.state);
  show_measurement(series.measurement, status.measurement);
  if (valid_ns_) series.age.Set(static_cast<double>(clock_.steady_ns() - *valid_ns_) * 1e-9);
  show(series.device, status.device);
  for (std::size_t i = 0; i < std::min(series.drivers.size(), counters.source.size()); ++i) {
    raise(*series.drivers[i], counters.source[i].value);
  }
  if (outputs_->file) outputs_->file->write(text());
}

std::string Metrics::text() const {
  return prometheus::TextSerializer().Serialize(series_->registry->Collect());
}

}  // namespace splid
