#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/model/chance.hpp"
#include "estimator/selection/target_selection.hpp"

namespace splid::selection {
// The brighter ones first.
void TargetSelection::judge_targets() {
  std::array<std::size_t, most_targets> order{};
  const std::size_t count = all_.model.count;
  for (std::size_t k = 0; k < count; ++k) order[k] = k, members_[k].is_detected = false;
  std::sort(order.begin(), order.begin() + count, [&](std::size_t a, std::size_t b) {
    return all_.model.targets[a].signal_per_pulse > all_.model.targets[b].signal_per_pulse;
  });
  for (std::size_t n = 0; n < count; ++n) {
    members_[order[n]].is_detected = stands(order[n], std::span(order).first(n));
  }
}

// Whether a target is one, and not what a brighter one's pulse leaves over.
bool TargetSelection::stands(std::size_t target, std::span<const std::size_t> brighter) {
  const DelayTrack& own = all_.model.targets[target].track;
  const double narrow = std::exp(-all_.model.log_width);
  std::optional<std::size_t> bright;
  for (const std::size_t k : brighter) {
    const DelayTrack& other = all_.model.targets[k].track;
    const double apart = apart_widths(own, other) * narrow;
    const double parting = parting_widths(own, other) * narrow;
    if (apart < closest_widths && parting < crossing_widths) return false;
    if (!bright && std::max(apart, parting) <= tail_widths) bright = k;
  }
  if (!bright) return true;
  refine();
  return beats_other_pulse(target, *bright);
}

// Whether a target explains more than another shape of a brighter one's pulse does, beside the
// others, and beside those that are known to be targets.
bool TargetSelection::beats_other_pulse(std::size_t target, std::size_t bright) {
  const Model& all = all_.model;
  const Target& own = all.targets[target];
  Target other = all.targets[bright];
  double log_width = all.log_width;
  const double apart = apart_widths(own.track, other.track);
  if (apart < pulse_reach_widths) {  // one wide pulse in their middle
    const double share = own.signal_per_pulse / (own.signal_per_pulse + other.signal_per_pulse);
    log_width += std::log1p(share * (1 - share) * apart * apart) / 2;
    other.track.delay_ns += share * apart_ns(own.track, other.track);
    other.track.walk_ns += share * (own.track.walk_ns - other.track.walk_ns);
    other.signal_per_pulse += own.signal_per_pulse;
  }
  const auto beats = [&](bool with_unknown) {
    Model without =
        likelihood::model_of(other.track, other.signal_per_pulse, all.background_per_ns);
    without.log_width = log_width;
    for (std::size_t k = 0; k < all.count; ++k) {
      const bool stays = k != target && k != bright && (with_unknown || members_[k].is_detected);
      if (stays) without.add(all.targets[k]);
    }
    return beats_shapes(without);
  };
  return beats(true) && (detected() + 1 >= all.count || beats(false));
}

// The photons about the track show most targets apart. Where they do not, all is fitted. Another
// shape of the brighter pulse has as many amounts as a target, chosen by the frame: certain nats
// more are asked for, and twice as many of the photons about the track alone.
bool TargetSelection::beats_shapes(const Model& without) {
  if (tail_.looks()) {
    tail_.count(*frame_, without);
    const double most_nats = tail_.nats(all_.model) - 2 * certain_nats;
    if (tail_.other_width_nats(without, most_nats) < most_nats &&
        tail_.with_tail_nats(most_nats) < most_nats) {
      return true;
    }
  }
  const std::size_t terms = terms_ > 1 ? 3 : 1;
  const Maximum wide =
      wide_.maximize(without, {.free = likelihood::free_set(without.count, terms, true),
                               .enough_nats = likelihood::Maximizer::compared_nats});
  const double more_nats = all_.gain_nats - wide.gain_nats - certain_nats;
  if (more_nats <= 0 || !tail_.looks()) return more_nats > 0;
  tail_.count(*frame_, wide.model);
  const double most_nats =
      tail_.other_width_nats(wide.model, std::numeric_limits<double>::infinity()) + more_nats;
  return tail_.with_tail_nats(most_nats) < most_nats;
}

}  // namespace splid::selection
