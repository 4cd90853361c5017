#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "estimator/sync/sync_clock.hpp"
#include "tests/fuzz/estimator_settings.hpp"
#include "tests/fuzz/fuzz.hpp"

// A frame of any photons, losses and syncs that the framer can make, at any time of 64 bits: the
// estimate has a status, and its values are finite and within their ranges.

namespace splid::test::fuzz_estimator {
namespace {

// What Framer makes of a stream: see Frame.
struct MadeFrame {
  FrameView view;
  std::vector<std::int64_t> photons_ps;
  std::vector<Loss> losses;
  std::vector<std::uint64_t> of_input;
};

// Through SyncClock, as in the framer: syncs nearly where they belong, or anywhere.
SyncFit some_sync(FuzzInput& input, const FrameView& view, double period_ps) {
  constexpr std::size_t most_syncs = 256;
  const auto length_ps = static_cast<double>(view.end_ps - view.start_ps);
  const auto count = std::min<std::size_t>(input.take<std::uint8_t>(), most_syncs);
  const double step =
      std::max(std::floor(length_ps / period_ps / std::max(1.0, double(count))), 1.0);
  std::vector<std::int64_t> syncs_ps;
  const double drift = 1 + input.take<std::int8_t>() * 4e-6;
  for (std::size_t i = 0; i < count; ++i) {
    double off_ps = input.take<std::int8_t>();
    if (off_ps == 127) off_ps = input.take<std::int32_t>();
    const double at_ps = double(i) * step * period_ps * drift + off_ps;
    if (at_ps >= 0 && at_ps < length_ps) syncs_ps.push_back(view.start_ps + std::llround(at_ps));
  }
  SyncClock clock(period_ps, static_cast<DriftMethod>(input.take<std::uint8_t>() % 3), most_syncs);
  return clock.fit(syncs_ps, view.start_ps, view.end_ps);
}

void add_losses(FuzzInput& input, MadeFrame& frame) {
  const auto length = static_cast<std::uint64_t>(frame.view.end_ps - frame.view.start_ps);
  std::int64_t at_ps = frame.view.start_ps;
  for (std::size_t left = input.take<std::uint8_t>() % 5; left > 0; --left) {
    const auto room = static_cast<std::uint64_t>(frame.view.end_ps - at_ps);
    if (room < 2) return;
    const std::int64_t begin_ps =
        at_ps + static_cast<std::int64_t>(input.take<std::uint64_t>() % (length + 1) % (room - 1));
    const auto longest = static_cast<std::uint64_t>(frame.view.end_ps - begin_ps);
    const std::int64_t end_ps =
        begin_ps + 1 + static_cast<std::int64_t>(input.take<std::uint64_t>() % longest);
    frame.losses.push_back({begin_ps, end_ps, -1});
    at_ps = end_ps + 1;
    if (at_ps >= frame.view.end_ps) return;
  }
}

void add_photons(FuzzInput& input, double period_ps, MadeFrame& frame) {
  const auto length = static_cast<std::uint64_t>(frame.view.end_ps - frame.view.start_ps);
  std::uint64_t at = 0;
  while (!input.empty() && frame.photons_ps.size() < 2 * most_photons) {
    const auto how = input.take<std::uint8_t>();
    if (how < 128) {
      at += how;  // a burst
    } else if (how < 250) {
      at += static_cast<std::uint64_t>(double(how - 127) * period_ps);  // a target
    } else {
      at = input.take<std::uint64_t>();
    }
    at %= length;
    frame.photons_ps.push_back(frame.view.start_ps + static_cast<std::int64_t>(at));
  }
}

// The values of a target that are to be finite; what is absent is 0.
auto values_of(const TargetEstimate& target) {
  return std::array{target.delay_ns,
                    target.std_delay_ns,
                    target.delay_start_ns,
                    target.velocity_mps,
                    target.std_velocity_mps,
                    target.signal_per_pulse,
                    target.std_signal_per_pulse,
                    target.significance_nats,
                    target.range_odds_nats};
}

// The same of a frame, without its list of targets.
auto values_of(const Estimate& e) {
  return std::array{e.delay_ns,
                    e.delay_start_ns,
                    e.velocity_mps,
                    e.acceleration_mps2,
                    e.signal_per_pulse,
                    e.background_per_ns,
                    e.std_delay_ns,
                    e.std_velocity_mps,
                    e.std_acceleration_mps2,
                    e.std_signal_per_pulse,
                    e.std_background_per_ns,
                    e.pulse_sigma_ns,
                    e.std_pulse_sigma_ns,
                    e.significance_nats,
                    e.threshold_nats,
                    e.range_odds_nats,
                    e.blind_fraction};
}

bool are_same(const Estimate& a, const Estimate& b) {
  const auto is_same = [](const TargetEstimate& of_a, const TargetEstimate& of_b) {
    return of_a.status == of_b.status && values_of(of_a) == values_of(of_b);
  };
  return a.status == b.status && a.has_values == b.has_values && a.stop == b.stop &&
         values_of(a) == values_of(b) && a.target_count == b.target_count &&
         std::equal(a.targets.begin(), a.targets.end(), b.targets.begin(), is_same);
}

void check_targets(const Estimate& e) {
  must(e.target_count <= most_targets, "a frame has four targets at most");
  for (std::size_t k = 0; k < e.target_count; ++k) {
    const TargetEstimate& target = e.targets.at(k);
    for (const double value : values_of(target)) {
      must(std::isfinite(value), "a target's values are finite");
    }
    must(target.status == FrameStatus::ok || target.status == FrameStatus::ambiguous,
         "a target has a status");
    must(target.signal_per_pulse >= 0, "a target's flux is not negative");
    must(target.std_delay_ns >= 0 && target.std_velocity_mps >= 0 &&
             target.std_signal_per_pulse >= 0,
         "a target's deviations are not negative");
    must(k == 0 || target.signal_per_pulse <= e.targets.at(k - 1).signal_per_pulse,
         "the brightest target is first");
  }
}

void check_values(const Estimate& e, const Pattern& pattern) {
  check_targets(e);
  for (const double value : values_of(e)) must(std::isfinite(value), "values are finite");
  must(e.status == FrameStatus::ok || e.status == FrameStatus::no_target ||
           e.status == FrameStatus::ambiguous || e.status == FrameStatus::no_sync,
       "an estimate has a status");
  must(e.background_per_ns >= 0, "a flux is not negative");
  must(e.blind_fraction >= 0 && e.blind_fraction < 1, "a share is below 1");
  if (e.status == FrameStatus::no_target || e.status == FrameStatus::no_sync) return;
  must(e.has_values, "a target has values");
  // Times of the tagger, in which the period may be 500 ppm longer.
  const double circle_ns =
      std::max(pattern.unambiguous_delay_ps, pattern_period_ps(pattern)) * 1e-3 * 1.0006;
  must(e.delay_ns >= 0 && e.delay_ns <= circle_ns, "a delay is within the unambiguous one");
  must(e.signal_per_pulse >= 0, "a flux is not negative");
  must(e.std_delay_ns >= 0 && e.std_velocity_mps >= 0 && e.std_acceleration_mps2 >= 0 &&
           e.std_signal_per_pulse >= 0 && e.std_background_per_ns >= 0 && e.std_pulse_sigma_ns >= 0,
       "deviations are not negative");
  must(e.std_pulse_sigma_ns == 0 || e.pulse_sigma_ns > 0, "a fitted pulse has a width");
}

void check(FuzzInput input) {
  Setting& setting = settings().at(input.take<std::uint8_t>() % settings().size());
  MadeFrame frame;
  constexpr std::int64_t furthest_ps = INT64_MAX - (std::int64_t{1} << 54);
  const auto start_ps = input.take<std::int64_t>();
  frame.view.start_ps = std::clamp(start_ps, -furthest_ps, furthest_ps);
  // Most of the nominal length; short, and as long as one that met no sync, are there too.
  const std::int64_t nominal_ps = std::llround(length_ms * 1e9);
  const auto how = input.take<std::uint8_t>();
  const std::int64_t length_ps =
      how < 200 ? nominal_ps + how * 1000 : 1 + nominal_ps * (how - 200) / 25;
  frame.view.end_ps = frame.view.start_ps + length_ps;
  frame.view.sync = some_sync(input, frame.view, setting.period_ps);
  add_losses(input, frame);
  add_photons(input, setting.period_ps, frame);
  frame.view.photons_ps = frame.photons_ps;
  const std::uint64_t photons = frame.photons_ps.size();
  const std::uint64_t of_one = photons == 0 ? 0 : photons * (frame.photons_ps[0] & 7) / 7;
  frame.of_input = {of_one, photons - of_one};
  frame.view.photons_of_input = frame.of_input;
  frame.view.losses = frame.losses;
  const std::array before_ps = {frame.view.start_ps - 30'000, frame.view.start_ps - 1};
  frame.view.before_ps = before_ps;

  const Estimate first = setting.estimator->estimate(frame.view);
  check_values(first, setting.pattern);
  must(are_same(setting.estimator->estimate(frame.view), first),
       "the same frame gives the same bits");
  TargetTrack track;
  check_values(setting.estimator->estimate(frame.view, &track), setting.pattern);
  check_values(setting.estimator->estimate(frame.view, &track), setting.pattern);
}

}  // namespace
}  // namespace splid::test::fuzz_estimator

SPLID_FUZZ_TARGET(estimator) {
  splid::test::fuzz_estimator::check({data, size});
  return 0;
}
