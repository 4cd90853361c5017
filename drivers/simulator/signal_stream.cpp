#include "drivers/simulator/signal_stream.hpp"

#include <algorithm>
#include <utility>

#include "drivers/simulator/echo.hpp"

namespace splid::simulator {
namespace {

// The first target draws from stream 1, and the scene's other parts from those up to 4.
constexpr std::uint64_t later_streams = 16;

}  // namespace

SignalStream::SignalStream(const Pattern& pattern, const DetectionOptions& options, DriftRate drift,
                           TargetPath motion, std::uint64_t seed, std::uint64_t target)
    : schedule_(pattern),
      options_(options),
      clock_(pattern, drift),
      sights_{{std::move(motion), options.signal_per_pulse}},
      random_(seed, target == 0 ? 1 : later_streams + target) {
  if (dark()) return;
  start_in_steady_state();
  next_photon();
}

SignalStream::SignalStream(const Pattern& pattern, const DetectionOptions& options, DriftRate drift,
                           std::vector<Sight> pixels, const Scanner& scanner, std::uint64_t seed)
    : schedule_(pattern),
      options_(options),
      clock_(pattern, drift),
      sights_(std::move(pixels)),
      scanner_(scanner),
      random_(seed, 1) {
  options_.signal_per_pulse = 0;
  for (const Sight& sight : sights_) {
    options_.signal_per_pulse = std::max(options_.signal_per_pulse, sight.signal_per_pulse);
  }
  if (!dark()) next_photon();
}

// Goes back in time until the light of the first period comes in before the stream starts, with its
// tail and jitter.
void SignalStream::start_in_steady_state() {
  // Fog adds two exponential ways of half of fog_m each.
  const double latest_ps =
      Random::largest_normal * (options_.sigma_ps + options_.emission_jitter_ps) +
      Random::largest_exponential * (options_.tail_ps + 2 * options_.fog_m / light_m_per_ps) +
      2 * motion().depth_m() / light_m_per_ps;
  for (std::int64_t back = 1; back < (std::int64_t{1} << 40); back *= 2) {
    GeneratorClock earlier = clock_;
    earlier.back_periods(back);
    const std::optional<FineTime> last = arrival(earlier.at(0));
    if (last && static_cast<double>(last->ps) + latest_ps >= 0) continue;
    clock_ = earlier;
    return;
  }
}

std::optional<FineTime> SignalStream::arrival(const FineTime& emitted) const {
  const std::optional<double> flight_ps = round_trip_ps(motion(), emitted);
  if (!flight_ps) return std::nullopt;
  return emitted.after(*flight_ps + options_.electronic_delay_ns * 1e3);
}

// Design note: detections are a Poisson process in the accumulated amplitude, so the step to the
// next detection is exponential, and pulses without a detection cost nothing. A pulse may have
// several detections.
void SignalStream::next_photon() {
  accumulated_ += random_.exponential() / options_.signal_per_pulse;
  is_placed_ = false;
}

// Places the next photon; returns whether it did. The periods before the photon are passed one by
// one, up to end_ps and no further: the next photon of a very dim target may be years away.
bool SignalStream::place_photon(std::int64_t end_ps) {
  while (accumulated_ >= schedule_.amplitude()) {
    if (clock_.period_start().ps >= end_ps) return false;
    accumulated_ -= schedule_.amplitude();
    clock_.next_period();
    pulse_time_ps_ = -1;
  }
  if (std::exchange(is_placed_, true)) return true;
  const double pulse_time_ps = schedule_.pulse_time_ps(accumulated_);
  if (pulse_time_ps != pulse_time_ps_ && options_.emission_jitter_ps > 0) {
    pulse_jitter_ps_ = options_.emission_jitter_ps * random_.normal();
  }
  pulse_time_ps_ = pulse_time_ps;
  emitted_ = clock_.at(pulse_time_ps).after(pulse_jitter_ps_);
  arrival_ = scanner_ ? arrival_in_scan() : arrival(emitted_);
  return true;
}

// The stream is that of the brightest pixel. Of the light to another pixel the same share comes
// back as the pixel is darker.
std::optional<FineTime> SignalStream::arrival_in_scan() {
  const double chance = random_.uniform();
  const std::optional<std::size_t> pixel = scanner_->pixel_at(emitted_.ps);
  if (!pixel) return std::nullopt;
  sight_ = *pixel;
  if (chance * options_.signal_per_pulse >= sights_[sight_].signal_per_pulse) return std::nullopt;
  return arrival(emitted_);
}

// How far behind the target's distance a photon is sent back. Fog: of the returns,
// optics that overlap the more the farther it is, and extinction, leave z exp(-z / scale).
double SignalStream::behind_m(const FineTime& arrival) {
  if (motion().depth_m() > 0) return motion().behind_m(arrival.seconds(), random_.uniform());
  if (options_.fog_m > 0) {
    return options_.fog_m / 2 * (random_.exponential() + random_.exponential());
  }
  return 0;
}

void SignalStream::detect() {
  if (!arrival_) return;
  double late_ps = options_.sigma_ps > 0 ? options_.sigma_ps * random_.normal() : 0;
  if (options_.tail_fraction > 0 && random_.uniform() < options_.tail_fraction) {
    late_ps += options_.tail_ps * random_.exponential();
  }
  late_ps += 2 * behind_m(*arrival_) * motion().clock_rate() / light_m_per_ps;
  const std::int64_t time_ps = arrival_->after(late_ps).rounded_ps();
  if (time_ps >= 0) pending_.insert(time_ps);
}

void SignalStream::fill(std::int64_t until_ps) {
  pending_.compact();
  if (dark()) return;
  const double early_ps =
      Random::largest_normal * (options_.sigma_ps + options_.emission_jitter_ps) + 1;
  const FineTime settled = FineTime{until_ps, 0}.after(early_ps);
  // Light of later periods comes in after `settled`, even where cables delay the sync more.
  const FineTime end = settled.after(early_ps + std::max(0.0, -options_.electronic_delay_ns * 1e3));
  // Photons that meet no target are passed over, in the order of their emission. Those of a scan
  // may overtake each other where the scanner turns from a far pixel to a near one.
  while (place_photon(end.ps) &&
         (arrival_ && !scanner_ ? arrival_->ps : emitted_.ps) < settled.ps) {
    detect();
    next_photon();
  }
}

}  // namespace splid::simulator
