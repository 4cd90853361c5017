#include "daemon/study/tradeoff/tradeoff_score.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/units.hpp"
#include "estimator/search/range_odds.hpp"
#include "protocol/pattern.hpp"

namespace splid::tradeoff {
namespace {

// The two neighbours on either side, and their weights in a cubic.
constexpr std::array<std::ptrdiff_t, 4> neighbours = {-2, -1, 1, 2};
constexpr std::array<double, 4> weights = {-1.0 / 6, 4.0 / 6, 4.0 / 6, -1.0 / 6};
constexpr double neighbours_noise_share = 34.0 / 36;

double wrapped(double difference_ns, const KeptFrame& frame, const Yardstick& unit) {
  // The scale is the tagger's clock over the pattern's: at 1000 ppm, a delay of five ranges would
  // be off by 19 ns without it.
  const double scale = frame.sync.period_ps > 0 ? frame.sync.period_ps / unit.period_ps : 1;
  return std::remainder(difference_ns, unit.circle_ns * scale);
}

double seconds_between(const KeptFrame& from, const KeptFrame& to) {
  return static_cast<double>(to.middle_ps() - from.middle_ps()) * 1e-12;
}

// How far the delay moves in time_s at this velocity.
double travel_ns(double velocity_mps, double time_s) {
  return 2e9 * velocity_mps / speed_of_light_mps * time_s;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::unique_ptr<PulseShape> pulse_shape(const Config& config) {
  if (config.pulse.shape == Shape::tabulated && config.pattern.pulse) {
    return make_tabulated(*config.pattern.pulse);
  }
  return make_gaussian(config.pulse.sigma_ps * ns_per_ps);
}

std::optional<TargetState> between_neighbours(std::span<const KeptFrame> frames,
                                              std::span<const FrameResult> results, std::size_t at,
                                              const Yardstick& unit) {
  TargetState state{0, 0};
  std::vector<double> straight_ns;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    const std::size_t k = at + static_cast<std::size_t>(neighbours[i]);
    const FrameResult& result = results[k];
    const double time_s = seconds_between(frames[k], frames[at]);
    const double steps = -time_s * 1e9 / unit.length_ns;
    if (!result.has_value || std::abs(steps - static_cast<double>(neighbours[i])) > 0.01) {
      return std::nullopt;
    }
    // The neighbour's delay is moved to this frame's time by the neighbour's own velocity. What is
    // left to wrap is then small, however far the target moves in a frame.
    const double moves_ns = travel_ns(result.velocity_mps, time_s);
    double there_ns = result.delay_ns + moves_ns;
    if (i > 0) {
      there_ns = straight_ns[0] + wrapped(there_ns - straight_ns[0], frames[at], unit);
    }
    straight_ns.push_back(there_ns);
    state.delay_ns += weights[i] * (there_ns - moves_ns);
    state.velocity_mps += weights[i] * result.velocity_mps;
  }
  const auto [low, high] = std::minmax_element(straight_ns.begin(), straight_ns.end());
  // The delay, and twice the travel over the frame, may each be as far off as they are on a right
  // peak.
  if (*high - *low > 3 * unit.wrong_delay_ns()) return std::nullopt;
  return state;
}

// Sums of the squared errors of frames on no wrong peak.
struct Squares {
  double delay = 0;
  double velocity = 0;
  std::size_t count = 0;
};

struct Comparison {
  Accuracy accuracy;
  Squares squares;
};

Comparison compare(std::span<const KeptFrame> frames, std::span<const FrameResult> results,
                   const Reference& reference, const Yardstick& unit) {
  Comparison made;
  for (std::size_t k = 0; k < results.size(); ++k) {
    if (frames[k].first) continue;
    ++made.accuracy.frames;
    if (!results[k].has_value) ++made.accuracy.no_value;
    const auto& state = reference.states[k];
    if (!results[k].has_value || !state) continue;
    ++made.accuracy.compared;
    const double delay_ns = wrapped(results[k].delay_ns - state->delay_ns, frames[k], unit);
    const double velocity_mps = unit.moving ? results[k].velocity_mps - state->velocity_mps : 0;
    if (std::abs(delay_ns) > unit.wrong_delay_ns() ||
        std::abs(velocity_mps) > unit.wrong_velocity_mps()) {
      ++made.accuracy.wrong_peaks;
      continue;
    }
    ++made.squares.count;
    made.squares.delay += delay_ns * delay_ns;
    made.squares.velocity += velocity_mps * velocity_mps;
  }
  return made;
}

// The mean square of the results' own errors: the mean square of the differences less the
// reference's share of it.
double own_mean_square(double squares, std::size_t count, double reference_squares,
                       std::size_t reference_count, double noise_share) {
  const double difference = squares / static_cast<double>(count);
  if (noise_share == 0 || reference_count == 0) return difference;
  const double reference =
      reference_squares / static_cast<double>(reference_count) / (1 + noise_share) * noise_share;
  return std::max(0.0, difference - reference);
}

}  // namespace

FrameResult frame_result(const Estimate& estimate, double range_risk, double compute_ms) {
  const bool found =
      estimate.status == FrameStatus::ok || estimate.status == FrameStatus::ambiguous;
  // With a pattern of mode ambiguous, where all frames are ambiguous, the odds are about the delay
  // within the pattern's range.
  const bool sure = estimate.range_odds_nats >= odds_at_risk_nats(range_risk);
  return {compute_ms,
          found && sure && estimate.has_values,
          estimate.delay_ns,
          estimate.velocity_mps,
          estimate.signal_per_pulse,
          estimate.background_per_ns};
}

double Yardstick::wrong_velocity_mps() const {
  return 5 * (width_ns / length_ns * speed_of_light_mps / 2 + bound.velocity_mps);
}

Reference truth_reference(std::span<const KeptFrame> frames) {
  Reference reference;
  for (const KeptFrame& frame : frames) reference.states.push_back(frame.truth);
  return reference;
}

Reference neighbour_reference(std::span<const KeptFrame> frames,
                              std::span<const FrameResult> results, const Yardstick& unit) {
  Reference reference;
  reference.noise_share = neighbours_noise_share;
  reference.states.resize(frames.size());
  for (std::size_t k = 2; k + 2 < results.size(); ++k) {
    reference.states[k] = between_neighbours(frames, results, k, unit);
  }
  return reference;
}

Yardstick make_yardstick(const Config& config, const std::optional<SceneTruth>& constants,
                         std::span<const KeptFrame> frames, std::span<const FrameResult> results) {
  const std::unique_ptr<PulseShape> shape = pulse_shape(config);
  Yardstick unit;
  unit.circle_ns = config.pattern.unambiguous_delay_ps * ns_per_ps;
  unit.period_ps = pattern_period_ps(config.pattern);
  unit.width_ns = shape->width_ns();
  unit.moving = config.scene.motion != Motion::static_target && config.scene.max_speed_mps > 0;
  std::vector<double> length_ns, seen, signal, background;
  for (const KeptFrame& frame : frames) {
    length_ns.push_back(frame.length_ns());
    seen.push_back(frame.seen_fraction);
  }
  for (const FrameResult& result : results) {
    if (!result.has_value) continue;
    signal.push_back(result.signal_per_pulse);
    background.push_back(result.background_per_ns);
  }
  unit.length_ns = median(length_ns);
  BoundScene scene;
  scene.length_ns = unit.length_ns;
  scene.seen_ns = unit.length_ns * median(seen);
  scene.moving = unit.moving;
  scene.accelerating = unit.moving && config.scene.motion == Motion::accelerating;
  scene.signal_per_pulse = constants ? constants->signal_per_pulse : median(signal);
  scene.background_per_ns = constants ? constants->background_per_s * 1e-9 : median(background);
  scene.detector = {config.detector.dead_time_ns,
                    static_cast<double>(config.channels.photon.size())};
  if (scene.signal_per_pulse > 0) unit.bound = cramer_rao_bound(config.pattern, *shape, scene);
  return unit;
}

Accuracy score(std::span<const KeptFrame> frames, std::span<const FrameResult> results,
               const Reference& reference, std::span<const FrameResult> reference_results,
               const Yardstick& unit) {
  const Comparison made = compare(frames, results, reference, unit);
  Accuracy accuracy = made.accuracy;
  const std::size_t count = made.squares.count;
  if (count == 0) return accuracy;
  const Squares other = compare(frames, reference_results, reference, unit).squares;
  const auto rmse = [&](double squares, double reference_squares) {
    return std::sqrt(
        own_mean_square(squares, count, reference_squares, other.count, reference.noise_share));
  };
  accuracy.delay_rmse_ns = rmse(made.squares.delay, other.delay);
  if (unit.moving) accuracy.velocity_rmse_mps = rmse(made.squares.velocity, other.velocity);
  return accuracy;
}

}  // namespace splid::tradeoff
