#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "daemon/stream/channel_map.hpp"
#include "daemon/stream/frame.hpp"
#include "daemon/stream/framer.hpp"
#include "protocol/scan_lines.hpp"
#include "protocol/tag.hpp"

namespace splid {

// The begin of dwell k of a line, and of dwell `pixels` its end: the line's time in equal parts or,
// where scan.sine_percent is not 0, in parts that a sinusoidal mirror sweeps equally. stop_ps is
// above start_ps by `pixels` at least. Source of the percentage: PicoQuant's ImgHdr_SinCorrection.
std::int64_t dwell_start_ps(const ScanLines& scan, std::int64_t start_ps, std::int64_t stop_ps,
                            std::int64_t k);

// Cuts the stream into the dwells of a scan, each a frame: keeps the tags of a line until its end
// has come, since only then is it known how long a dwell is.
//
//  - One record may have the bits of several markers. Of markers at one time a line's stop is
//    first, then a picture's begin, then a line's start.
//  - A tag at a dwell's begin belongs to the dwell, and a tag at its end to the next.
//  - Tags between two lines, before the first line and after the last are in no frame, and counted
//    as `outside`. A line that has no end, since the next line begins first, the clock breaks, or
//    more tags come than there is room for, makes no frames; its tags are outside, and it is
//    counted. So is the line that is open when the stream ends, but in a count of its own.
//  - The tags are put in order first, as far as they are out of order by 1 us at most. A tag that
//    comes still later than that is in its dwell if the line is still open, and otherwise outside.
//
// Threads: one. Errors: none; FrameSink::open() may wait. No allocation after construction.
class ScanCutter {
 public:
  // room: tags that a line may have. framer: outlives this.
  ScanCutter(const ScanLines& scan, const ChannelMap& channels, std::size_t room, Framer& framer);

  // As Framer::push().
  void push(std::span<const Tag> tags, std::int64_t arrival_ns);
  // The stream is over.
  void finish();

 private:
  void settle_all();
  void settle_old();
  void put_in_order();
  void settle(std::size_t count);
  [[nodiscard]] int rank(const Tag& tag) const;
  void take(const Tag& tag);
  void take_marker(const Tag& tag);
  void begin_line(std::int64_t start_ps);
  void end_line(std::int64_t stop_ps);
  void give_up_line();
  void put_line_outside();
  void put_outside(std::span<const Tag> tags);
  void make_dwells(std::span<const Tag> tags, std::int64_t start_ps, std::int64_t stop_ps);
  void count_tick(const Tag& tag);
  [[nodiscard]] double tick_at(std::int64_t time_ps) const;

  ScanLines scan_;
  ChannelMap channels_;
  Framer& framer_;
  FixedArray<Tag> recent_;  // not yet in order
  FixedArray<Tag> line_;    // of the open line
  std::int64_t arrival_ns_ = 0;
  std::optional<std::int64_t> line_start_ps_;  // absent between lines
  ScanPlace place_;                            // in the open line
  std::int64_t picture_ = 0;
  std::int64_t next_line_ = 0;  // of the picture

  // The encoder's ticks so far.
  std::int64_t ticks_ = 0;
  std::int64_t tick_ps_ = 0, tick_before_ps_ = 0;  // the last two
};

}  // namespace splid
