#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// More of the light than this is never taken as lost, so that what is left can be divided by.
inline constexpr double most_blind = 0.999;

// When a frame's detector was dead: from each detection on for the dead time, also from detections
// shortly before the frame. Each time of this kind ends at an instant that is folded as if it were
// a photon; it begins at a photon of the frame, or at one of `begins`: at the frame's start, or at
// the end of a loss that it reaches beyond.
//
// Dead time in a loss does not count, as a loss is not seen anyway. With a single detector input a
// detection ends the dead time of the detection before it, where that comes too late for the dead
// time by the jitter of the tagger, say. With several inputs each detection hides one of them, and
// counts by the share of the light that a detection hides on average: if c_k photons came on input
// k, which gets the share s_k of the light, that is the sum of c_k s_k over the sum of c_k. The
// light that an input got is c_k / (1 - c_k f), where f is the part of all light that comes within
// a dead time of one detection. Which input a photon came on need not be known. Where the c_k are
// not known, the light is shared evenly.
struct DeadIntervals {
  FoldedFrame ends;
  FoldedFrame begins;   // those that are no photons of the frame
  double dead_time_ns;  // tagger's clock
  double share;         // of the light, that a detection hides
  double dead_ns = 0;   // in all, by that share; tagger's clock

  // train: as for FoldedFrame. inputs: >= 1.
  DeadIntervals(const PulseTrain& train, double dead_time_ns, std::size_t inputs,
                std::size_t max_photons, double reach_ns);
  // frame: locked to its syncs. Sets all members. False where the detections contradict the dead
  // time: more of them follow each other sooner, within 0.9 dead times, than moves a value by a
  // tenth of its deviation, or hardly any time is left in which the detector could have been live.
  bool find(const FrameView& frame, const PulseTrain& train);
  // Becomes the dead time of the frame that FoldedFrame::straighten() makes: all ends and begins
  // move back, as the photons do. curved: of the same detector.
  void straighten(const DeadIntervals& curved, double quadratic_ns, const PulseTrain& train);

 private:
  void share_by_pairs(const FrameView& frame, std::span<const std::int64_t> times_ps);
  void add(const FrameView& frame, std::int64_t from_ps, std::int64_t to_ps);
  // first_ps: the first photon of the frame.
  void add_before(const FrameView& frame, std::int64_t first_ps);
  std::span<const std::int64_t> in_order(std::span<const std::int64_t> photons_ps);

  double even_share_;
  std::int64_t dead_time_ps_;
  std::vector<std::int64_t> times_ps_;             // scratch: photons that came in no order
  std::vector<std::int64_t> ends_ps_, begins_ps_;  // scratch
  std::int64_t sum_ps_ = 0;
  std::size_t next_loss_ = 0;
};

}  // namespace splid
