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

// estimator/reference/ computes a frame's reference from an encoder on the target: the distance and
// velocity that people compare the estimate with.

// How an encoder's counts become distances.
struct EncoderScale {
  double m_per_count = 1e-4;  // not 0; negative where the counts fall as the target goes away
  double offset_m = 0;        // distance at count 0
};

// Where the encoder says that the target is.
struct EncoderPosition {
  double distance_m = 0;    // at mid-frame
  double velocity_mps = 0;  // slope over the frame, positive away from the lidar
};

// Joins the encoder's counts to the tags of its sample clock, by index: the k-th marker since the
// clock was started is the time of count k.
//
//  - A run of markers begins with the first marker after at least 0.1 s without any. A run
//    of counts begins with a batch of index 0. The n-th run of markers belongs to the n-th of
//    counts.
//  - The clock is regular, so that a marker that comes 25 % early or late shows that a marker is
//    missing, or that there is one too many. Either breaks the join up to the next run, as do an
//    overrun and a jump of the counts' index. A loss of tags that hid no marker breaks nothing.
//  - Markers that come back after a pause in which tags were lost may or may not begin a new run:
//    the join is then lost for good. So it is where the counts of a live source are two seconds, or
//    more than 16 starts, ahead of the markers.
//
// Threads: one. Errors: none; see fault().
class EncoderJoin {
 public:
  // live: the counts come as the encoder makes them, not from a file.
  EncoderJoin(const EncoderScale& scale, bool live) : scale_(scale), live_(live) {}

  // Takes the frames in their order. markers_ps: in [start_ps, end_ps), in any order; losses:
  // sorted by begin.
  void take_frame(std::int64_t start_ps, std::int64_t end_ps,
                  std::span<const std::int64_t> markers_ps, std::span<const Loss> losses);
  // Takes the batches in their order. Each may come before or after its markers.
  void take_counts(const EncoderBatch& batch);

  // How many counts are kept for markers that have not come; at most 4,194,304 of a live source.
  [[nodiscard]] std::size_t waiting() const;
  // Whether counts of the last frame are missing that may still come.
  [[nodiscard]] bool waits() const;
  // The position in the last frame, by least squares over its samples. Absent where the join is
  // broken, where counts are missing, and where the samples span less than half of the frame.
  [[nodiscard]] std::optional<EncoderPosition> position() const;
  // Why there is no join, and what to do, in a sentence. Empty where there is a join, and where no
  // marker has come yet.
  [[nodiscard]] std::string fault() const;

 private:
  // The counts from a start of the clock to the next start.
  struct Run {
    bool whole = true;             // without gap since index 0
    std::int64_t first_index = 0;  // index of counts.front(); earlier counts are no longer needed
    std::deque<std::int64_t> counts;
    // The counter's first and last value, and what it misses since it passed its end of 32 bits.
    std::optional<std::int64_t> first_value;
    std::int64_t last_value = 0;
    std::int64_t passed = 0;

    void add(std::int64_t value);
  };

  void take_marker(std::int64_t time_ps);
  void forget_old_counts();
  [[nodiscard]] bool is_regular(std::int64_t time_ps) const;
  [[nodiscard]] const Run* run() const;

  EncoderScale scale_;
  bool live_;

  // Markers.
  std::int64_t start_ps_ = 0;  // of the last frame
  std::int64_t end_ps_ = 0;    // of the last frame
  bool has_frame_ = false;
  std::vector<std::int64_t> times_ps_;   // times of the samples in the last frame
  std::int64_t next_index_ = 0;          // index of the sample after its last
  std::int64_t marker_run_ = 0;          // counts from 1
  bool marker_broken_ = false;           // since the run's start
  bool lost_step_ = false;               // for good
  std::int64_t run_start_ps_ = 0;        // marker 0
  std::optional<std::int64_t> last_ps_;  // time of the last marker
  std::int64_t quiet_since_ps_ = 0;      // no marker since this time

  // Counts.
  std::map<std::int64_t, Run> runs_;  // by number; runs that the markers have passed are erased
  std::int64_t count_run_ = 0;
  std::int64_t expected_index_ = 0;
};

}  // namespace splid
