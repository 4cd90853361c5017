#include "daemon/output/frame_fold.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "estimator/likelihood/exposure.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double stack_reach_widths = 10;
constexpr double plane_reach_widths = 4;
constexpr std::size_t stack_bins = PhotonFold::stack_bins;
constexpr std::size_t plane_cells = PhotonFold::plane_cells;

// Points of the table of h in a pulse width: between two of them a straight line is off by 1e-3 of
// the peak at most, which no colour shows.
constexpr double densities_a_width = 16;

// The plane asks 4,096 times for the logarithm of each near photon. Of frames that have more than
// this after gathering a sample is taken, so that the plane takes some 0.1 s at most.
constexpr std::size_t most_plane_photons = 8192;

// Of a pattern of more pulses, that many show the light about a pulse.
constexpr std::size_t most_pulses_looked_at = 1000;

double bin_ns_of(const PulseShape& shape) {
  return 2 * stack_reach_widths * shape.width_ns() / stack_bins;
}

std::vector<CombWindow> windows_about(const PulseTrain& train, const PulseShape& shape) {
  const double beyond = stack_reach_widths * shape.width_ns();
  return comb_windows(train, std::min(0.0, shape.first_ns()) - beyond,
                      std::max(0.0, shape.last_ns()) + beyond);
}

double wrapped(double time_ns, double period_ns) {
  const double turned = time_ns - period_ns * std::floor(time_ns / period_ns);
  return turned < period_ns ? turned : 0;
}

}  // namespace

FrameFold::FrameFold(const Pattern& pattern, const PulseOptions& pulse, ClockReference reference)
    : train_(pattern),
      shape_(configured_pulse(pattern, pulse)),
      reference_(reference),
      windows_(windows_about(train_, *shape_)),
      light_(stack_bins, 0.0),
      frame_(train_, 0),
      straight_(train_, 0),
      sample_(train_, 0),
      near_(0, 0) {
  const double step_ns = shape_->width_ns() / densities_a_width;
  const auto points =
      static_cast<std::size_t>(std::ceil((shape_->last_ns() - shape_->first_ns()) / step_ns) + 2);
  std::vector<double> offsets(points);
  for (std::size_t i = 0; i < points; ++i) {
    offsets[i] = shape_->first_ns() + static_cast<double>(i) * step_ns;
  }
  densities_.resize(points);
  std::vector<double> slope(points), curve(points);
  shape_->evaluate(offsets, {densities_, slope, curve});
  for (std::size_t s = 0; s < train_.segments.size(); ++s) {
    add_light(train_.segments[s], windows_[s]);
  }
}

// Adds a segment's light about its pulses: the sum over pulses p of sum_q a_q h(t_p + x - t_q), for
// a ns of the whole period.
void FrameFold::add_light(const PulseTrain::Segment& segment, const CombWindow& window) {
  const Comb& comb = segment.comb;
  const double bin_ns = bin_ns_of(*shape_);
  const std::size_t step = 1 + comb.times_ns.size() / most_pulses_looked_at;
  const double looked_at =
      std::ceil(static_cast<double>(comb.times_ns.size()) / static_cast<double>(step));
  const double weight = static_cast<double>(comb.times_ns.size()) / looked_at / comb.period_ns *
                        (segment.end_ns - segment.begin_ns) / train_.period_ns;
  for (std::size_t p = 0; p < comb.times_ns.size(); p += step) {
    const double turns = comb.times_ns[p] / comb.period_ns;
    const auto phase = static_cast<std::uint32_t>(static_cast<std::uint64_t>(turns * 0x1p32));
    for (const CombWindow::Pulse& pulse : window.candidates(phase)) {
      const double first_ns =
          comb.times_ns[p] - pulse.time_ns - stack_reach_widths * shape_->width_ns() + bin_ns / 2;
      for (std::size_t i = 0; i < stack_bins; ++i) {
        light_[i] += weight * pulse.amplitude * density(first_ns + static_cast<double>(i) * bin_ns);
      }
    }
  }
}

double FrameFold::density(double offset_ns) const {
  const double at = (offset_ns - shape_->first_ns()) * densities_a_width / shape_->width_ns();
  if (!(at >= 0) || at >= static_cast<double>(densities_.size() - 1)) return 0;
  const auto below = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(below);
  return densities_[below] * (1 - share) + densities_[below + 1] * share;
}

PhotonFold FrameFold::fold(const FrameView& view, const Estimate& estimate) {
  PhotonFold pictures;
  if (!view.sync.locked || view.photons_ps.empty()) return pictures;
  frame_.fold(view, train_);
  if (!estimate.has_values || !(frame_.seen_ns > 0)) {
    pictures.period = period_of(frame_, {});
    return pictures;
  }
  DelayTrack line = track_of(estimate);
  const FoldedFrame* frame = &frame_;
  if (line.quadratic_ns != 0) {
    straight_.straighten(frame_, line.quadratic_ns, train_);
    frame = &straight_;
    line.quadratic_ns = 0;
  }
  const double share = static_cast<double>(view.photons_ps.size()) /
                       static_cast<double>(std::max(estimate.photons, view.photons_ps.size()));
  pictures.period = period_of(*frame, line);
  pictures.period->moved_back = true;
  pictures.stack = stack_of(*frame, line, estimate, share);
  pictures.plane = plane_of(*frame, line, estimate, share);
  return pictures;
}

// What FrameEstimator makes of a track, solved for the track.
DelayTrack FrameFold::track_of(const Estimate& estimate) const {
  DelayTrack track;
  double velocity_mps = estimate.velocity_mps;
  if (estimate.std_acceleration_mps2 > 0) {
    track.quadratic_ns = estimate.acceleration_mps2 / acceleration_of(1, frame_.length_ns);
    velocity_mps -= estimate.acceleration_mps2 * estimate.delay_ns * 1e-9 / 2;
  }
  const double beta = velocity_mps / speed_of_light_mps;
  const double scale = reference_ == ClockReference::tagger ? frame_.scale : 1;
  track.delay_ns = estimate.delay_ns / scale / (1 + beta) + track.quadratic_ns / 2;
  track.walk_ns = 2 * beta / (1 + beta) * frame_.length_ns;
  return track;
}

PhotonFold::Period FrameFold::period_of(const FoldedFrame& frame, DelayTrack line) const {
  PhotonFold::Period period;
  period.bin_ns = train_.period_ns / PhotonFold::period_bins;
  period.counts.assign(PhotonFold::period_bins, 0);
  const double slope = line.walk_ns / frame.length_ns;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double left_ns =
        wrapped(frame.phase_ns[i] - line.delay_ns - slope * frame.time_ns[i], train_.period_ns);
    const auto bin = static_cast<std::size_t>(left_ns / period.bin_ns);
    ++period.counts[std::min(bin, PhotonFold::period_bins - 1)];
  }
  return period;
}

PhotonFold::Stack FrameFold::stack_of(const FoldedFrame& frame, DelayTrack line,
                                      const Estimate& estimate, double share) {
  PhotonFold::Stack stack;
  stack.bin_ns = bin_ns_of(*shape_);
  stack.first_ns = -stack_reach_widths * shape_->width_ns();
  stack.counts.assign(stack_bins, 0);
  near_.collect(frame, windows_, train_, line);
  for (const double residual_ns : near_.residual_ns) {
    const double bin = std::floor((residual_ns - stack.first_ns) / stack.bin_ns);
    if (bin >= 0 && bin < static_cast<double>(stack_bins)) {
      ++stack.counts[static_cast<std::size_t>(bin)];
    }
  }
  const double background = estimate.background_per_ns * train_.pulses_per_ns;
  for (const double light : light_) {
    stack.expected.push_back(share * frame.seen_ns * stack.bin_ns *
                             (estimate.signal_per_pulse * light + background));
  }
  return stack;
}

// The sum over the near photons of log(1 + S sum_p a_p h / b), at another line than near_'s own.
double FrameFold::log_gain(DelayTrack line, double signal_over_background) const {
  const double delay = line.delay_ns - near_.track.delay_ns;
  const double walk = line.walk_ns - near_.track.walk_ns;
  double sum = 0;
  for (std::size_t k = 0; k < near_.photons(); ++k) {
    double light = 0;
    for (std::size_t j = near_.first[k]; j < near_.first[k + 1]; ++j) {
      light +=
          near_.amplitude[j] * density(near_.residual_ns[j] - delay - walk * near_.position[j]);
    }
    if (light > 0) sum += near_.weight[k] * std::log1p(signal_over_background * light);
  }
  return sum;
}

PhotonFold::Plane FrameFold::plane_of(const FoldedFrame& frame, DelayTrack line,
                                      const Estimate& estimate, double share) {
  near_.collect(frame, windows_, train_, line, shape_->width_ns());
  double photons_each = 1 / share;  // that a photon of the near set stands for
  if (const std::size_t near = near_.photons(); near > most_plane_photons) {
    const std::size_t step = (near + most_plane_photons - 1) / most_plane_photons;
    sample_.take_every(step, frame);
    near_.collect(sample_, windows_, train_, line);
    photons_each *= static_cast<double>(step);
  }
  // A frame without background is one with a photon of it: else a photon beside the line would
  // count without bound.
  const double least = 1 / frame.seen_ns;
  const double background = std::max(estimate.background_per_ns, least);
  const double photons = static_cast<double>(frame.size()) / share;
  const Exposure exposure(frame, train_);
  const double none = photons * std::log(photons / exposure.seen_ns / background) - photons +
                      background * exposure.seen_ns;

  const double half = static_cast<double>(plane_cells - 1) / 2;
  const double delay_step = plane_reach_widths * shape_->width_ns() / half;
  const double walk_step = 2 * delay_step;
  PhotonFold::Plane plane;
  plane.delay_step_ns = delay_step;
  plane.velocity_step_mps = walk_step / frame.length_ns / 2 * speed_of_light_mps;
  plane.gain_nats.reserve(plane_cells * plane_cells);
  for (std::size_t row = 0; row < plane_cells; ++row) {
    const double walk = line.walk_ns + (static_cast<double>(row) - half) * walk_step;
    const double seen =
        estimate.signal_per_pulse * exposure.amplitude * (1 - walk / frame.length_ns);
    for (std::size_t column = 0; column < plane_cells; ++column) {
      const double delay = line.delay_ns + (static_cast<double>(column) - half) * delay_step;
      plane.gain_nats.push_back(
          photons_each * log_gain({delay, walk}, estimate.signal_per_pulse / background) - seen -
          none);
    }
  }
  return plane;
}

}  // namespace splid
