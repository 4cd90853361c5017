#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "estimator/model/frame_view.hpp"
#include "protocol/pattern.hpp"

namespace splid::test {

// A frame as a target would make it, from first principles and apart from the product's code: every
// pulse leaves, meets the target on its way and comes back, in long double.
struct FrameMaker {
  Pattern pattern;
  double length_ms = 50;
  double distance_m = 284.5;     // at mid-frame
  double velocity_mps = 0;       // at mid-frame
  double acceleration_mps2 = 0;  // at mid-frame
  double jerk_mps3 = 0;          // by which the acceleration changes
  double signal_per_pulse = 13.5e-4;
  double background_per_ns = 1.75e-4;
  double sigma_ns = 0.1;
  double late_share = 0;  // of the light that is late, by a time of which late_ns is the mean
  double late_ns = 0;
  double drift_ppm = 0;   // of the pattern's clock, as the tagger counts
  double tagger_ppm = 0;  // by which the tagger's clock is fast
  std::int64_t start_ps = 0;
  double dead_time_ns = 0;  // of a detector that is not blind for longer by what it does not see
  int inputs = 1;           // detectors that the light is split over, each blind on its own
  double first_share = 0;   // of the light that the first of them gets; 0: as much as the others
  // Relative amplitudes of sines by which the light swings over the frame; rms is 0.7 of that.
  double signal_swing = 0, background_swing = 0;
  double swing_hz = 200;
  double afterpulse_probability = 0;  // that a detection is followed by one without light
  double afterpulse_ns = 30;          // mean time from the end of the dead time to that afterpulse

  struct Frame {
    std::vector<std::int64_t> photons_ps;
    std::vector<Loss> losses;
    std::int64_t start_ps, end_ps;
    SyncFit sync;
    std::vector<std::int64_t> before_ps;
    std::vector<std::uint64_t> photons_of_input = {};  // empty with a single input
    [[nodiscard]] FrameView view() const {
      return {start_ps, end_ps, photons_ps, losses, sync, before_ps, photons_of_input};
    }
  };

  [[nodiscard]] Frame make(std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    Frame frame;
    const long double scale = 1 + drift_ppm * 1e-6L;
    const long double period_ps = pattern_period_ps(pattern) * scale;
    const auto periods = std::max(1LL, std::llround(length_ms * 1e9L / period_ps));
    frame.start_ps = start_ps;
    frame.end_ps = start_ps + std::llround(periods * period_ps);
    const std::int64_t mid = frame.start_ps + (frame.end_ps - frame.start_ps) / 2;
    const long double length_ps = frame.end_ps - frame.start_ps;
    const long double rate = 1 + tagger_ppm * 1e-6L;     // tagger's seconds in a true second
    const long double c = 299792458.0L * 1e-12L / rate;  // m in a ps of the tagger's
    const long double v = velocity_mps * 1e-12L / rate;
    // A pulse leaves at e after mid-frame; it meets the target where c (h - e) = z(h).
    const long double a = acceleration_mps2 * 1e-24L / (rate * rate);
    const long double j = jerk_mps3 * 1e-36L / (rate * rate * rate);
    // With a = 0 the root is c - v, and this is the line's own solution.
    const auto arrival = [&](long double e) {
      const long double ahead = c * e + distance_m;
      const long double root = std::sqrt((c - v) * (c - v) - 2 * a * ahead);
      long double hit = a == 0 ? ahead / (c - v) : 2 * ahead / (c - v + root);
      if (j != 0) {
        for (int step = 0; step < 3; ++step) {  // Newton's
          const long double path = distance_m + hit * (v + hit * (a / 2 + hit * j / 6));
          hit -= (c * (hit - e) - path) / (c - v - hit * (a + hit * j / 2));
        }
      }
      return 2 * hit - e;
    };
    std::normal_distribution<double> jitter(0, sigma_ns * 1e3);
    std::bernoulli_distribution is_late(late_share);
    std::exponential_distribution<double> late(late_share > 0 ? 1e-3 / late_ns : 1);
    const auto offset_ps = [&] {
      const double of_pulse = jitter(random);
      return late_share > 0 && is_late(random) ? of_pulse + late(random) : of_pulse;
    };
    // The detector has forgotten its first state after so many dead times.
    const std::int64_t from_ps = frame.start_ps - std::llround(20e3 * dead_time_ns);
    const std::int64_t reach =
        static_cast<std::int64_t>((2 * distance_m / c + 20e3L * dead_time_ns) / period_ps) + 3;
    long double begin_ps = 0;  // of the segment in the pattern period
    for (const PatternSegment& segment : pattern.segments) {
      const std::int64_t repeats = pattern.segments.size() == 1 ? 1 : segment.repeats;
      for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
        const double mean = signal_per_pulse * segment.amplitudes[p] * (1 + signal_swing);
        if (mean <= 0) continue;
        // Gaps between detections are exponential in accumulated amplitude.
        std::exponential_distribution<double> gap(mean);
        const double turns =
            static_cast<double>(periods + 2 * reach) * static_cast<double>(repeats);
        for (double at = gap(random); at < turns; at += gap(random)) {
          const auto turn = static_cast<std::int64_t>(at);
          const auto whole = static_cast<long double>(turn / repeats - reach);
          const auto repeat = static_cast<long double>(turn % repeats);
          const long double in_pattern =
              begin_ps + repeat * segment.period_ps + segment.pulse_times_ps[p];
          const long double e = whole * period_ps + in_pattern * scale - length_ps / 2;
          const auto t = mid + std::llround(arrival(e) + offset_ps());
          if (t < from_ps || t >= frame.end_ps || !shines(t, signal_swing, random)) continue;
          frame.photons_ps.push_back(t);
        }
      }
      begin_ps += static_cast<long double>(repeats) * segment.period_ps;
    }
    std::poisson_distribution<std::int64_t> background(
        std::max(1e-300, background_per_ns * (1 + background_swing) *
                             static_cast<double>(frame.end_ps - from_ps) * 1e-3));
    std::uniform_int_distribution<std::int64_t> anywhere(from_ps, frame.end_ps - 1);
    if (background_per_ns > 0) {
      for (std::int64_t n = background(random); n > 0; --n) {
        const std::int64_t t = anywhere(random);
        if (shines(t, background_swing, random)) frame.photons_ps.push_back(t);
      }
    }
    std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
    if (dead_time_ns > 0 || inputs > 1 || afterpulse_probability > 0) blind(frame, random);
    frame.sync.locked = true;
    frame.sync.origin_ps = frame.start_ps;
    frame.sync.phase_ps = 0;
    frame.sync.period_ps = static_cast<double>(period_ps);
    frame.sync.drift_ppm = drift_ppm;
    return frame;
  }

  // The same scene of a target beside this one, with this share of its signal.
  [[nodiscard]] FrameMaker beside(double further_m, double faster_mps, double share) const {
    FrameMaker other = *this;
    other.distance_m += further_m;
    other.velocity_mps += faster_mps;
    other.signal_per_pulse *= share;
    return other;
  }

  // A frame of several targets: this one, and others of which each has its own light. The
  // background is this one's.
  [[nodiscard]] Frame make_with(const std::vector<FrameMaker>& others, std::uint64_t seed) const {
    Frame frame = make(seed);
    for (std::size_t k = 0; k < others.size(); ++k) {
      FrameMaker other = others[k];
      other.background_per_ns = 0;
      const Frame more = other.make(seed * 16 + k + 1'000'003);
      frame.photons_ps.insert(frame.photons_ps.end(), more.photons_ps.begin(),
                              more.photons_ps.end());
    }
    std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
    frame.photons_of_input.clear();
    return frame;
  }

  // Whether a photon of the brightest light is one of light that swings.
  [[nodiscard]] bool shines(std::int64_t t, double swing, std::mt19937_64& random) const {
    if (swing == 0) return true;
    const double turns = static_cast<double>(t) * 1e-12 * swing_hz;
    const double light = 1 + swing * std::sin(2 * std::numbers::pi * turns);
    return std::bernoulli_distribution(light / (1 + swing))(random);
  }

  // Leaves of the photons what the detectors see, with their afterpulses, and parts them at the
  // frame's start.
  void blind(Frame& frame, std::mt19937_64& random) const {
    const auto count = static_cast<std::size_t>(inputs);
    std::uniform_int_distribution<std::size_t> any(0, count - 1);
    std::vector<double> shares(count, (1 - first_share) / static_cast<double>(count - (count > 1)));
    if (first_share > 0) shares[0] = first_share;
    std::discrete_distribution<std::size_t> uneven(shares.begin(), shares.end());
    std::vector<std::int64_t> blind_until(count, INT64_MIN);
    std::vector<std::int64_t> release(count, INT64_MAX);
    std::vector<std::int64_t> seen;
    frame.photons_of_input.assign(count > 1 ? count : 0, 0);
    std::bernoulli_distribution traps(afterpulse_probability);
    std::exponential_distribution<double> later(1e-3 / afterpulse_ns);
    const auto detect = [&](std::int64_t t, std::size_t input) {
      if (t < blind_until[input]) return;
      blind_until[input] = t + std::llround(dead_time_ns * 1e3);
      (t < frame.start_ps ? frame.before_ps : seen).push_back(t);
      if (t >= frame.start_ps && count > 1) ++frame.photons_of_input[input];
      if (afterpulse_probability > 0 && traps(random)) {
        release[input] = blind_until[input] + std::llround(later(random));
      }
    };
    const auto release_until = [&](std::int64_t t) {
      for (;;) {
        const auto next = std::min_element(release.begin(), release.end());
        if (*next >= t) return;
        detect(std::exchange(*next, INT64_MAX), static_cast<std::size_t>(next - release.begin()));
      }
    };
    for (const std::int64_t t : frame.photons_ps) {
      release_until(t);
      detect(t, first_share > 0 ? uneven(random) : any(random));
    }
    release_until(frame.end_ps);
    frame.photons_ps = seen;
  }
};

// One pulse at the times n t_k of each sub-period, every instant once.
inline Pattern interleaved_pattern(const std::vector<std::int64_t>& subperiods_ps,
                                   std::int64_t period_ps) {
  std::vector<std::int64_t> times;
  Pattern pattern;
  for (const std::int64_t step : subperiods_ps) {
    pattern.subperiods_ps.push_back(static_cast<double>(step));
    for (std::int64_t t = 0; t < period_ps; t += step) times.push_back(t);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  pattern.mode = Mode::interleaved;
  pattern.unambiguous_delay_ps = static_cast<double>(period_ps);
  PatternSegment segment;
  segment.period_ps = static_cast<double>(period_ps);
  segment.pulse_times_ps.assign(times.begin(), times.end());
  segment.amplitudes.assign(times.size(), 1.0);
  pattern.segments = {segment};
  return pattern;
}

// Periods in turn, each for about as long, in `turns_ps` in all.
inline Pattern mrr_pattern(const std::vector<double>& periods_ps, double unambiguous_delay_ps,
                           double turns_ps) {
  Pattern pattern;
  pattern.mode = Mode::mrr;
  pattern.unambiguous_delay_ps = unambiguous_delay_ps;
  pattern.subperiods_ps = periods_ps;
  for (const double period_ps : periods_ps) {
    const double share_ps = turns_ps / static_cast<double>(periods_ps.size());
    pattern.segments.push_back({period_ps, {0.0}, {1.0}, std::llround(share_ps / period_ps)});
  }
  return pattern;
}

inline Pattern periodic_pattern(double period_ps) {
  Pattern pattern;
  pattern.mode = Mode::baseline;
  pattern.unambiguous_delay_ps = period_ps;
  pattern.segments = {{period_ps, {0.0}, {1.0}, 0}};
  return pattern;
}

// Pulses at least min_spacing_ps apart, around the end too, drawn until they fit.
inline Pattern random_pattern(double period_ps, std::size_t pulses, double min_spacing_ps,
                              std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const double slack_ps = period_ps - static_cast<double>(pulses) * min_spacing_ps;
  std::uniform_real_distribution<double> uniform(0, slack_ps);
  std::vector<double> free_ps(pulses);
  for (double& at : free_ps) at = uniform(random);
  std::sort(free_ps.begin(), free_ps.end());
  Pattern pattern;
  pattern.mode = Mode::random;
  pattern.unambiguous_delay_ps = period_ps;
  PatternSegment segment;
  segment.period_ps = period_ps;
  for (std::size_t p = 0; p < pulses; ++p) {
    segment.pulse_times_ps.push_back(free_ps[p] + static_cast<double>(p) * min_spacing_ps);
  }
  segment.amplitudes.assign(pulses, 1.0);
  pattern.segments = {segment};
  return pattern;
}

}  // namespace splid::test
