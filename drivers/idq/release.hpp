#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "drivers/idq/join.hpp"
#include "drivers/idq/options.hpp"
#include "drivers/tag_writer.hpp"

namespace splid::idq {

// Makes tags of sub-acquisitions, in the order of time, and hands them on as the time passes in
// which they came: a sub-acquisition at once would be 200 ms of silence and then several frames.
// The time of the stream is the index times the period, plus the time in the sub-acquisition. The
// dead time between two sub-acquisitions is a loss of unknown count, and so is a sub-acquisition
// that lacks times. A tag's 64 bits last 106 days: every 53 days there is a clock_break and times
// go on from 0.
//
// Threads: one. Errors: none.
class Release {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Messages may come so much later than others without a gap in the stream.
  static constexpr std::chrono::milliseconds slack{50};

  // Both outlive this object.
  Release(const Options& options, TagSink& sink);

  void add(SubAcquisition part, Time now);
  // Hands on what is due by now.
  void run(Time now);
  // Hands on all that was added.
  void flush();

  [[nodiscard]] bool has_begun() const { return reached_ps_ > 0; }
  // Where the stream is.
  [[nodiscard]] std::int64_t reached_ps() const { return reached_ps_; }

 private:
  void begin_clock(std::int64_t index);
  [[nodiscard]] std::int64_t begin_of(const SubAcquisition& part) const;
  void advance(std::int64_t until_ps);
  bool merge(std::int64_t begin_ps, std::int64_t until_ps);
  void end_part(std::int64_t begin_ps);

  const Options& options_;
  TagWriter out_;
  std::deque<SubAcquisition> parts_;  // the first may be under way
  bool is_under_way_ = false;
  std::vector<std::size_t> next_;  // of each input, in the first part
  std::int64_t first_index_ = 0;   // of the clock
  std::int64_t reached_ps_ = 0;
  bool has_anchor_ = false;
  Time anchor_;  // when the time anchor_ps_ is due
  std::int64_t anchor_ps_ = 0;
};

}  // namespace splid::idq
