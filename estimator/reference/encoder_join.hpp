#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/encoder_batch.hpp"
#include "protocol/tag.hpp"

namespace splid {

// How an encoder's counts are distances.
struct EncoderScale {
  double m_per_count = 1e-4;  // not 0; negative where the counts fall as the target goes away
  double offset_m = 0;        // distance at count 0
};

// Where the encoder says that the target is.
struct EncoderPosition {
  double distance_m = 0;    // at mid-frame
  double velocity_mps = 0;  // slope over the frame, positive away
};

// Joins the encoder's counts to the tags of its sample clock, by index: the k-th marker since the
// clock was started is the time of count k.
//
//  - A run begins with the first marker after at least 0.1 s that were seen to have none, and with
//    the first batch of index 0. The n-th run of markers is the n-th of counts.
//  - The clock is regular, so a marker that comes 25 % early or late of its time shows that one is
//    missing or too many. That breaks the join up to the next run, as do an overrun and a jump of
//    the counts' index. A loss of tags that hid no marker breaks nothing.
//  - Markers that come back after a pause in which tags were lost may be those of a new run or not:
//    the join is then lost for good, as it is where counts of a live source are two seconds ahead
//    of the markers.
//
// Threads: one. Errors: none; see fault().
class EncoderJoin {
 public:
  // live: the counts come as the encoder makes them, not from a file.
  EncoderJoin(const EncoderScale& scale, bool live) : scale_(scale), live_(live) {}

  // Frames in their order. markers_ps: in [start_ps, end_ps), in any order; losses: sorted.
  void take_frame(std::int64_t start_ps, std::int64_t end_ps,
                  std::span<const std::int64_t> markers_ps, std::span<const Loss> losses);
  // Batches in their order, sooner or later than their markers.
  void take_counts(const EncoderBatch& batch);

  // The counts of the last frame have not all come, and still may.
  [[nodiscard]] bool waits() const;
  // Of the last frame, by least squares over its samples; absent where the join is broken, counts
  // are missing or the samples span less than half of the frame.
  [[nodiscard]] std::optional<EncoderPosition> position() const;
  // Why there is no join, and what to do, in a sentence; empty where there is one or nothing came
  // yet.
  [[nodiscard]] std::string fault() const;

 private:
  // Of the counts, from a start of the clock to the next.
  struct Run {
    bool whole = true;             // without gap since index 0
    std::int64_t first_index = 0;  // of counts; those before are no longer needed
    std::deque<std::int64_t> counts;
  };

  void take_marker(std::int64_t time_ps);
  void forget_old_counts();
  [[nodiscard]] bool is_regular(std::int64_t time_ps) const;
  [[nodiscard]] const Run* run() const;

  EncoderScale scale_;
  bool live_;

  // Markers.
  std::int64_t start_ps_ = 0;  // of the last frame
  std::int64_t end_ps_ = 0;    // likewise
  bool has_frame_ = false;
  std::vector<std::int64_t> times_ps_;   // of the samples in it
  std::int64_t next_index_ = 0;          // after its last sample
  std::int64_t marker_run_ = 0;          // counts from 1
  bool marker_broken_ = false;           // since the run's start
  bool lost_step_ = false;               // for good
  std::int64_t run_start_ps_ = 0;        // marker 0
  std::optional<std::int64_t> last_ps_;  // marker before
  std::int64_t quiet_since_ps_ = 0;      // no marker from there on, seen for certain

  // Counts.
  std::map<std::int64_t, Run> runs_;  // by number, those not yet passed
  std::int64_t count_run_ = 0;
  std::int64_t expected_index_ = 0;
};

}  // namespace splid
