#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"

namespace splid {

// What the frames of a second say together: what comes of the measurement, and what stands out.
//
// Threads: one. Errors: none.
class LastSecond {
 public:
  using Findings = std::vector<FrameMessage::Finding>;

  // threads: that share the frames.
  explicit LastSecond(double threads) : threads_(threads) {}

  // A stream begins: what the frames before it have said is forgotten.
  void begin() { *this = LastSecond(threads_); }
  // recent: what this frame and those before it show together.
  void add(const FrameMessage& message, const Findings& recent);
  // What is below is that of the frames since the last call from here on.
  void end();
  // The same at once after seconds without a frame, for all but the findings.
  void look();
  [[nodiscard]] bool has_frames() const { return now_.frames > 0; }

  // `ok` where most frames are; else what most of the others are: the status of a frame, the name
  // of the finding that its photons contradict the pattern, or `no_signal` where it has no photon.
  // `none` without a frame.
  [[nodiscard]] const std::string& measurement() const { return measurement_; }
  // A sentence that says why it is not ok, empty where the status of frames says it (incomplete,
  // no_sync, saturated); and one that says why frames cost more than they last.
  [[nodiscard]] const std::string& why() const { return why_; }
  [[nodiscard]] const std::string& of_cost() const { return of_cost_; }
  // Those that half of the frames with a target have, or half of all where none with a target has
  // it, with their last values; then those of `recent`. The surest first.
  [[nodiscard]] const Findings& findings() const { return findings_; }
  // The photons contradict the pattern.
  [[nodiscard]] bool contradicts_pattern() const { return contradicts_pattern_; }

 private:
  struct Seen {
    int frames = 0, valid = 0;
    FrameMessage::Finding last;
  };
  struct Second {
    int frames = 0, valid = 0;
    int unsure = 0;                           // ambiguous by their photons and not by the mode
    std::map<std::string, int> measurements;  // frames of each
    std::map<std::string, Seen> findings;     // by name
    Findings recent;
    std::string pattern_name;  // of the finding that a frame contradicts the pattern
    double computed_ms = 0, lasted_ms = 0;
  };
  void judge_measurement();
  void judge_findings();
  void explain();
  [[nodiscard]] std::string why_ambiguous() const;

  double threads_;
  Second now_;
  static constexpr const char* none = "none";
  static constexpr const char* no_frame = "no frame has come";
  std::string measurement_ = none, why_ = no_frame, of_cost_;
  Findings findings_;
  bool contradicts_pattern_ = false;
  bool was_empty_ = true;  // the last second
};

}  // namespace splid
