#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/simulator/pending_times.hpp"
#include "drivers/simulator/random.hpp"
#include "protocol/options.hpp"

namespace splid::simulator {

// What the detectors do to the light. JSON: `source`/`detector`.
struct DetectorModel {
  double dead_time_ns = 0;  // non-paralysable: light that comes while a detector is dead is lost,
                            // and does not prolong it
  double afterpulse_probability = 0;  // that a detection is followed by one without light
  double afterpulse_ns = 30;          // mean time from the end of the dead time to that afterpulse
  // Timing walk: a wait since the detector's last detection in ns, ascending, and by how much a
  // detection after such a wait comes late, ps. Linear in between, as in the first row before it,
  // and none behind the last.
  std::vector<NumberPair> walk = {};
  std::int64_t inputs = 1;  // detectors that the light is split over evenly, each with an input

  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

struct Detection {
  int detector = 0;          // from 0
  std::int64_t late_ps = 0;  // by which its tag is late, of timing walk
};

// The detectors of a scene. What an ideal detector would detect is offered to them in the order of
// time, and they say which of it they detect. Each detector is dead on its own, from its own
// detections. An afterpulse is the release of a carrier that the detection before it has trapped:
// it starts a dead time and may have an afterpulse like any other detection, and it is lost where
// the detector is dead when the carrier is released.
//
// Threads: one. No allocation once the fullest stretch has passed.
class Detectors {
 public:
  Detectors(const DetectorModel& model, std::uint64_t seed);

  // Light that an idle detector would detect at time_ps: the detector that does so, or nothing
  // where the detector that the light falls on is dead. Times ascend, together with those of
  // take_release().
  std::optional<Detection> detect(std::int64_t time_ps);

  // The time at which the next trapped carrier is released, or PendingTimes::none.
  [[nodiscard]] std::int64_t next_release_ps() const {
    return releases_.empty() ? PendingTimes::none : releases_.front().time_ps;
  }
  // The release at next_release_ps(): the detector that it is an afterpulse of, if it is not dead.
  std::optional<Detection> take_release();

 private:
  struct Release {
    std::int64_t time_ps;
    int detector;
  };
  static bool is_later(const Release& a, const Release& b) { return a.time_ps > b.time_ps; }
  std::optional<Detection> fire(int detector, std::int64_t time_ps);
  [[nodiscard]] std::int64_t late_ps(std::int64_t wait_ps) const;

  bool ideal_;  // one detector without dead time, afterpulses and walk
  std::int64_t dead_time_ps_;
  double afterpulse_probability_;
  double afterpulse_ps_;
  std::vector<NumberPair> walk_;
  Random random_;
  std::vector<std::int64_t> dead_until_ps_;  // of each detector
  std::vector<Release> releases_;            // a heap, the earliest first
};

}  // namespace splid::simulator
