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
double walk_ns(double velocity_mps, double time_s) {
  return 2e9 * velocity_mps / speed_of_light_mps * time_s;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
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
    const double moves_ns = walk_ns(result.velocity_mps, time_s);
    double there_ns = result.delay_ns + moves_ns;
    if (i > 0) {
      there_ns = straight_ns[0] + wrapped(there_ns - straight_ns[0], frames[at], unit);
    }
    straight_ns.push_back(there_ns);
    state.delay_ns += weights[i] * (there_ns - moves_ns);
    state.velocity_mps += weights[i] * result.velocity_mps;
  }
  const auto [low, high] = std::minmax_element(straight_ns.begin(), straight_ns.end());
  // The delay, and twice the range walk over the frame, may each be as far off as they are on a
  // right peak.
  if (*high - *low > 3 * unit.wrong_delay_ns()) return std::nullopt;
  return state;
}

// Sums of the squared errors of frames on no wrong peak.
struct Squares {
  double delay = 0;
  double velocity = 0;
  double count = 0;

  void add(const Squares& other, double sign = 1) {
    delay += sign * other.delay;
    velocity += sign * other.velocity;
    count += sign * other.count;
  }
};

struct Comparison {
  Accuracy accuracy;
  Squares squares;
  std::array<Squares, interval_blocks> blocks;  // of frames in a row
};

// How many frames are in a block. Errors against neighbours depend on those of four frames on
// either side, so that a block has some frames more.
std::size_t block_length(std::size_t frames, const Reference& reference) {
  constexpr std::size_t least_beside_neighbours = 10;
  const std::size_t tenth = (frames + interval_blocks - 1) / interval_blocks;
  return std::max(tenth, reference.noise_share > 0 ? least_beside_neighbours : 1);
}

Comparison compare(std::span<const KeptFrame> frames, std::span<const FrameResult> results,
                   const Reference& reference, const Yardstick& unit) {
  Comparison made;
  const std::size_t length = block_length(frames.size(), reference);
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
    const Squares squares = {delay_ns * delay_ns, velocity_mps * velocity_mps, 1};
    made.squares.add(squares);
    made.blocks.at(k / length).add(squares);
  }
  return made;
}

// The mean square of the results' own errors: the mean square of the differences less the
// reference's share of it, which may leave less than nothing.
double own_mean_square(double Squares::*error, const Squares& squares, const Squares& reference,
                       double noise_share) {
  const double difference = squares.*error / squares.count;
  if (noise_share == 0 || reference.count == 0) return difference;
  return difference - reference.*error / reference.count / (1 + noise_share) * noise_share;
}

// The part of a mean square's variance that is between blocks of errors against neighbours. Errors
// that are 1 to 4 frames apart correlate by r = -0.8, 0.4, -0.114 and 0.014, as the weights have
// it; 2 sum(k r_k^2) / (1 + 2 sum(r_k^2)) frames of a block share their variance with the next
// block.
double shared_by_blocks(std::size_t frames, const Reference& reference) {
  constexpr double frames_shared = 0.76;
  if (reference.noise_share == 0) return 0;
  return frames_shared / static_cast<double>(block_length(frames, reference));
}

std::optional<Interval> interval_of(double Squares::*error, const Comparison& own,
                                    const Comparison& other, double noise_share, double shared) {
  std::vector<double> without;
  for (std::size_t i = 0; i < interval_blocks; ++i) {
    if (own.blocks.at(i).count == 0) continue;
    Squares rest = own.squares;
    Squares rest_of_reference = other.squares;
    rest.add(own.blocks.at(i), -1);
    rest_of_reference.add(other.blocks.at(i), -1);
    if (rest.count == 0) return std::nullopt;
    without.push_back(own_mean_square(error, rest, rest_of_reference, noise_share));
  }
  const double mean_square = own_mean_square(error, own.squares, other.squares, noise_share);
  return mean_square > 0 ? interval_of_rms(mean_square, without, shared) : std::nullopt;
}

}  // namespace

std::unique_ptr<PulseShape> pulse_shape(const Config& config) {
  if (config.pulse.shape == Shape::tabulated && config.pattern.pulse) {
    return make_tabulated(*config.pattern.pulse);
  }
  return make_gaussian(config.pulse.sigma_ps * ns_per_ps);
}

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
  if (made.squares.count == 0) return accuracy;
  const Comparison other = compare(frames, reference_results, reference, unit);
  const double share = reference.noise_share;
  const double shared = shared_by_blocks(frames.size(), reference);
  const auto rmse = [&](double Squares::*error) {
    return std::sqrt(std::max(0.0, own_mean_square(error, made.squares, other.squares, share)));
  };
  accuracy.delay_rmse_ns = rmse(&Squares::delay);
  accuracy.delay_interval = interval_of(&Squares::delay, made, other, share, shared);
  if (!unit.moving) return accuracy;
  accuracy.velocity_rmse_mps = rmse(&Squares::velocity);
  accuracy.velocity_interval = interval_of(&Squares::velocity, made, other, share, shared);
  return accuracy;
}

}  // namespace splid::tradeoff
