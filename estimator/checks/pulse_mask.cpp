#include "estimator/checks/pulse_mask.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double mask_widths = 6;

// A part of a comb's period, in 2^-32 of it.
std::uint32_t part_of_period(double time_ns, double to_turns) {
  const double turns = time_ns * to_turns;
  return static_cast<std::uint32_t>(
      static_cast<std::uint64_t>((turns - std::floor(turns)) * 0x1p32));
}

}  // namespace

PulseMask::PulseMask(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons)
    : period_ns_(train.stretches.front().comb.period_ns) {
  if (!train.single()) return;
  const double reach_ns = mask_widths * shape.width_ns();
  window_.emplace(train.stretches.front().comb, std::max(shape.first_ns(), -reach_ns),
                  std::min(shape.last_ns(), reach_ns));
  is_in_pulse_.reserve(max_photons);
}

std::span<const std::uint8_t> PulseMask::mark(const FoldedFrame& photons, std::size_t first,
                                              std::size_t count, double to_reference,
                                              const Estimate& estimate) {
  if (!window_ || !estimate.has_values) return {};
  is_in_pulse_.assign(count, 0);
  const auto mark_target = [&](double delay_ns, double velocity_mps) {
    const double beta = velocity_mps / speed_of_light_mps;
    mark_line(
        photons, first,
        {delay_ns / to_reference / (1 + beta), travel_ns_at(velocity_mps, photons.length_ns)});
  };
  mark_target(estimate.delay_ns, estimate.velocity_mps);
  for (std::size_t k = 1; k < estimate.target_count; ++k) {
    mark_target(estimate.targets.at(k).delay_ns, estimate.targets.at(k).velocity_mps);
  }
  return is_in_pulse_;
}

void PulseMask::mark_line(const FoldedFrame& photons, std::size_t first, DelayLine line) {
  const double to_turns = 1 / period_ns_;
  const double g = line.travel_ns / photons.length_ns;
  for (std::size_t i = 0; i < is_in_pulse_.size(); ++i) {
    const double delay_ns = line.delay_ns + g * photons.time_ns[first + i];
    const std::uint32_t at = photons.phase_32[first + i] - part_of_period(delay_ns, to_turns);
    is_in_pulse_[i] |= window_->flags()[at >> window_->shift()];
  }
}

}  // namespace splid
