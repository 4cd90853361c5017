#include "estimator/fold/dead_time_model.hpp"

#include <cmath>

namespace splid {
namespace {

// A dead time that moves no value by more than this, in deviations, is left out.
constexpr double least_correction = 0.05;

}  // namespace

DeadTimeModel::DeadTimeModel(const PulseTrain& train, double dead_time_ns, std::size_t inputs,
                             std::size_t max_photons, double reach_ns)
    : train_(train), dead_(train, dead_time_ns, inputs, max_photons, reach_ns) {}

// The share of the light that comes while the detector is dead, where light is spread evenly.
double DeadTimeModel::loss(const FoldedFrame& frame) const {
  return static_cast<double>(frame.size()) * dead_.dead_time_ns * dead_.share / frame.seen_ns;
}

// Gives the frame its dead time, unless the detections contradict the dead time: more of them
// follow each other sooner than moves a value by a tenth of its deviation, or hardly any time is
// left in which the detector could have been live.
void DeadTimeModel::take(const FrameView& view, FoldedFrame& frame) {
  constexpr double few = 2;
  constexpr double deviations = 0.1;
  constexpr double most_blind = 0.999;
  dead_.find(view, train_);
  const double most = few + deviations * std::sqrt(static_cast<double>(frame.size()));
  holds_ = (dead_.share < 1 || static_cast<double>(dead_.early) <= most) &&
           dead_.dead_ns <= most_blind * frame.seen_ns;
  if (holds_) frame.dead = &dead_;
}

void DeadTimeModel::look(const FrameView& view, FoldedFrame& frame) {
  frame.dead = nullptr;
  holds_ = true;
  dead_.share_roughly(view);
  const double deviations = loss(frame) * std::sqrt(static_cast<double>(frame.size()));
  if (deviations >= least_correction) take(view, frame);
}

// Whether the dead time moves a value because photons keep later photons of their own pulse from
// being seen. S then reads low by S / 2 of itself.
bool DeadTimeModel::do_pulses_feel_it(const FoldedFrame& frame, double signal_per_pulse) const {
  const double S = signal_per_pulse * train_.mean_amplitude() * dead_.share;
  const double signal = S * train_.pulses_per_ns * frame.seen_ns;
  return S / 2 * std::sqrt(signal) >= least_correction;
}

bool DeadTimeModel::look_at_pulses(const FrameView& view, FoldedFrame& frame,
                                   double signal_per_pulse) {
  if (!holds_ || frame.dead != nullptr || !do_pulses_feel_it(frame, signal_per_pulse)) return false;
  take(view, frame);
  return frame.dead != nullptr;
}

void DeadTimeModel::say(const FoldedFrame& frame, Estimate& estimate) const {
  estimate.dead_time_modelled = holds_;
  estimate.blind_fraction = !holds_                 ? 0
                            : frame.dead != nullptr ? frame.dead->dead_ns / frame.seen_ns
                                                    : loss(frame);
}

}  // namespace splid
