#pragma once

#include <algorithm>

#include "estimator/model/options.hpp"

namespace splid {

// Lowers the estimator's effort where it is slower than the frames come, before a tag is dropped,
// and raises it again when there is time.
//
// The effort goes down a step as soon as a frame found no free unit: the estimator is then two
// frames behind. It goes up a step after 20 frames that found a free unit (a second). Each time
// that going up was too early, twice as many frames are waited for, at most 1280 (a minute), so
// that a load at the edge does not make every other frame coarse.
//
// Threads: one. Errors: none.
class EffortGovernor {
 public:
  // configured: the effort that is never exceeded. enabled: false keeps that effort for every
  // frame, as for a replay, which waits instead.
  EffortGovernor(Effort configured, bool enabled)
      : configured_(configured), effort_(configured), enabled_(enabled) {}

  // Sets the effort that is never exceeded from now on.
  void configure(Effort configured) {
    if (configured == configured_) return;
    configured_ = effort_ = configured;
    calm_frames_ = 0;
  }

  // The effort of the next frame. had_to_wait: the frame found no free unit at first.
  Effort next(bool had_to_wait) {
    if (!enabled_) return configured_;
    if (had_to_wait) {
      fall();
    } else if (++calm_frames_ >= patience_frames_ && effort_ != configured_) {
      effort_ = static_cast<Effort>(static_cast<int>(effort_) + 1);
      calm_frames_ = 0;
      raised_ = true;
    } else if (calm_frames_ >= patience_frames_) {
      patience_frames_ = least_patience_frames;
    }
    return effort_;
  }

 private:
  void fall() {
    if (effort_ != Effort::fast) effort_ = static_cast<Effort>(static_cast<int>(effort_) - 1);
    if (raised_) patience_frames_ = std::min(2 * patience_frames_, most_patience_frames);
    raised_ = false;
    calm_frames_ = 0;
  }

  static constexpr int least_patience_frames = 20;
  static constexpr int most_patience_frames = 1280;

  Effort configured_;
  Effort effort_;
  bool enabled_;
  bool raised_ = false;  // the effort went up, and has not fallen since
  int calm_frames_ = 0;
  int patience_frames_ = least_patience_frames;
};

}  // namespace splid
