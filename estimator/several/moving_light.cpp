#include "estimator/several/moving_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "estimator/likelihood/log_sum.hpp"
#include "estimator/several/light_about.hpp"

namespace splid {
namespace {

// Lines part over the frame by so much, and are so close at mid-frame, that the photons about the
// target are also those about the other line and about all places where the target has been.
constexpr double least_moved_widths = 1, most_moved_widths = 12, closest_to_widths = 8;

}  // namespace

bool MovingLight::Verdict::does_move(double least_nats) const {
  return nats > least_nats && left < SlopesLeft::most_by_chance;
}

MovingLight::Verdict MovingLight::judge(const NearSet& near, const JointParameters& at,
                                        std::size_t target, std::size_t other) const {
  const TargetParameters& own = at.targets.at(target);
  const DelayLine& line = at.targets.at(other).line;
  const double apart_ns = std::remainder(own.line.delay_ns - line.delay_ns, train_.circle_ns);
  const double moved_ns = std::abs(own.line.travel_ns - line.travel_ns);
  const double widths = moved_ns / shape_.width_ns();
  if (widths < least_moved_widths || widths > most_moved_widths ||
      std::abs(apart_ns) > closest_to_widths * shape_.width_ns()) {
    return {};
  }
  // The middle of the places where the target has been, beside the other's line.
  const DelayLine middle = {own.line.delay_ns, line.travel_ns};
  LogSum moves, stays;
  SlopesLeft left;
  LightAbout of_own, of_one;
  OfPhotons begins_ns, ends_ns, before, after;
  for (std::size_t first = 0; first < near.entries(); first += photons_at_once) {
    const std::size_t count = std::min(photons_at_once, near.entries() - first);
    OfPhotons others, d1, d2;
    others.fill(at.background_per_ns);
    of_own.see(shape_, near, first, count, own, train_.circle_ns);
    d1 = of_own.d1, d2 = of_own.d2;
    for (std::size_t k = 0; k < at.count; ++k) {
      if (k == target) continue;
      of_one.see(shape_, near, first, count, at.targets[k], train_.circle_ns);
      for (std::size_t i = 0; i < count; ++i) {
        others[i] += of_one.h[i], d1[i] += of_one.d1[i], d2[i] += of_one.d2[i];
      }
    }
    offsets_from(near, first, count, middle, train_.circle_ns, begins_ns);
    for (std::size_t i = 0; i < count; ++i) {
      ends_ns[i] = begins_ns[i] + moved_ns / 2;
      begins_ns[i] -= moved_ns / 2;
    }
    shape_.integrate(std::span(begins_ns).first(count), before);
    shape_.integrate(std::span(ends_ns).first(count), after);
    for (std::size_t i = 0; i < count; ++i) {
      const double S = own.signal_per_pulse * near.amplitude[first + i];
      const double as_moving = others[i] + of_own.h[i];
      const double as_staying = others[i] + S * (after[i] - before[i]) / moved_ns;
      if (!(as_moving > 0 && as_staying > 0)) continue;
      moves.add(as_moving);
      stays.add(as_staying);
      left.add(near.position[first + i], d1[i] / as_moving, d2[i] / as_moving);
    }
  }
  return {moves.value() - stays.value(), left.squared_deviations()};
}

}  // namespace splid
