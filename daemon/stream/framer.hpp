#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "daemon/stream/channel_map.hpp"
#include "daemon/stream/frame.hpp"
#include "daemon/stream/frame_plan.hpp"
#include "daemon/stream/pixel_rooms.hpp"
#include "daemon/stream/silence.hpp"
#include "daemon/stream/sync_diagnosis.hpp"
#include "daemon/stream/timing_walk.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "protocol/tag.hpp"

namespace splid {

// stream.hpp shows the whole way from a source's tags to estimated frames. This header says where a
// frame begins and ends, and where a lost tag is counted.

// Where every tag went. Each event (photon, sync or marker) is counted once:
//   events = photons + syncs + markers - shared + ignored + late + surplus + outside
// The lost_tags of all frames together, plus unplaced, are late + surplus + reported.
struct FramerTotals {
  std::uint64_t events = 0;
  std::uint64_t photons = 0;   // in frames
  std::uint64_t syncs = 0;     // in frames
  std::uint64_t markers = 0;   // in frames
  std::uint64_t shared = 0;    // further uses of a tag that holds several markers
  std::uint64_t ignored = 0;   // on channels that the configuration does not name
  std::uint64_t late = 0;      // earlier than the open frame, or a single tag far ahead of it
  std::uint64_t surplus = 0;   // more than a frame can hold
  std::uint64_t reported = 0;  // lost, with a count that the stream itself gives
  std::uint64_t unplaced = 0;  // lost while no frame is open; the next frame takes them over
  std::uint64_t frames = 0;
  std::uint64_t jumps = 0;               // gaps for which no frames were made
  std::uint64_t resets = 0;              // how often the tagger's clock was set anew
  std::uint64_t uncounted = 0;           // losses of an unknown number of tags
  std::uint64_t beyond = 0;              // of the late: in a run of times beyond the range
  std::uint64_t outside = 0;             // of a scan: in no dwell
  std::uint64_t lines = 0;               // of a scan, or frames from marker to marker
  std::uint64_t cut_lines = 0;           // of a scan: begun without an end, their tags are outside
  std::uint64_t open_lines = 0;          // of a scan: in which the stream ended, as the cut ones
  std::uint64_t half_picture_lines = 0;  // of the first picture, where these are too few
};

// Cuts the stream of tags into frames. It takes spans of tags in stream order, wherever the spans
// are cut, and emits closed frames. A frame is a whole number of pattern periods in the tagger's
// clock: the number that comes nearest to length_ms. It starts where the frame before it ended, and
// ends at a pattern start that the syncs tell. Without syncs it has its nominal length and is not
// locked.
//
//  - A frame closes as soon as any tag or heartbeat is 1 us past its end. So tags that are out of
//    order by up to 1 us are in the frame that they belong to. Tags that come still later are
//    counted as `late` in the frame that is open then.
//  - An event past the frame's end that is more than 1 us ahead of the tag before it waits until
//    the next tag is that far ahead too. So a single stray time stamp costs that tag alone
//    (`late`). Two stray time stamps together cost the rest of the open frame, until 16 earlier
//    tags in a row set the clock back.
//  - A gap of more than max(1 s, 20 frames) makes no empty frames: the open frame is closed with
//    its rest as a loss, and framing starts anew after the gap. A shorter gap makes empty frames.
//  - 16 tags in a row before the open frame's start, or a clock_break, mean that the tagger's clock
//    was set anew. The open frame is closed with its rest as a loss; the first 15 of those tags are
//    `late`. A step back that stays within the open frame is not noticed.
//  - Times within 5 h of the largest and smallest 64-bit number are beyond the range. A single such
//    tag is `late`. 16 in a row are a clock at its end: the open frame is closed as where the clock
//    was set anew, and for each length of time that such tags come there is a frame without tags,
//    with their number as lost, at the end of the range.
//  - A loss is clipped to the frames that it touches; its count goes to the frame in which it ends.
//    A `missed` tag has no interval: the loss is taken to reach back to the tag before it. A
//    loss_end without its loss_begin reaches back to the end of the loss before it, or to the
//    frame's start. A loss that is open when the clock is set anew ends there, since its loss_end
//    may never come.
//  - Photons beyond the frame's room are counted (`surplus`), and the rest of the frame is a loss;
//    of several pixels, for the pixel whose room is full alone.
//  - Time in which an instrument sends nothing although it should is a loss too, though no tag
//    tells of it: see Silence.
//
// Threads: one. Errors: none; FrameSink::open() may wait. No allocation after construction.
class Framer {
 public:
  Framer(const FramerOptions& options, const ChannelMap& channels, FrameSink& sink);

  // arrival_ns: when the tags came, by any steady clock; it becomes Frame::arrival_ns. The delay of
  // each photon's input and its timing walk are subtracted first, which may put photons out of
  // order by as much.
  void push(std::span<const Tag> tags, std::int64_t arrival_ns);
  // A frame of given bounds, whole, as ScanCutter makes them. tags: events and control tags in
  // [start_ps, end_ps), sorted by time, as undelayed() gives them. The next call, or outside(), is
  // of a later time; none of push() is in between.
  void push_dwell(const ScanPlace& place, std::int64_t start_ps, std::int64_t end_ps,
                  std::span<const Tag> tags, std::int64_t arrival_ns);
  // A tag that is in no dwell. A loss that it begins, ends or tells of is kept for the next dwell.
  void outside(const Tag& tag);
  // The tag without the delay of its input and its timing walk. In the order of the stream.
  Tag undelayed(const Tag& tag) { return corrects() ? corrected(tag) : tag; }
  // A line has begun; has not ended; or has not ended before the stream.
  void count_line() { ++totals_.lines; }
  void count_open_line() { ++totals_.open_lines; }
  void count_cut_line() { ++totals_.cut_lines; }
  void tell_half_picture(std::int64_t lines) {
    totals_.half_picture_lines = static_cast<std::uint64_t>(lines);
  }

  // The stream is over: emits the last frame, if it holds or lost any tag, with the time that the
  // stream did not reach as a loss. Tags pushed afterwards begin a new stream.
  void finish();

  [[nodiscard]] const FramerTotals& totals() const { return totals_; }
  // Why no frame locks; set after three frames with 16 syncs or more did not lock and before any
  // frame did.
  [[nodiscard]] const std::optional<SyncDiagnosis>& diagnosis() const { return diagnosis_; }

 private:
  // Which ends of the open frame are already placed on pattern starts.
  enum class Ends { neither, start, both };

  [[nodiscard]] bool corrects() const { return channels_.has_delays() || !walk_.is_none(); }
  Tag corrected(const Tag& tag);
  void push_in_time(std::span<const Tag> tags);
  // Returns the first tag that it did not take.
  template <bool keeps_photons>
  const Tag* take_run(const Tag* tag, const Tag* last);
  const Tag* take_run_of_pixels(const Tag* tag, const Tag* last);
  void count_inputs(const Tag* tag, const Tag* last);
  void run_ended(std::size_t used, std::size_t taken, const Tag* next);

  void take(const Tag& tag);
  void take_beyond(std::int64_t time_ps);
  void close_beyond();
  void take_control(const Tag& tag);
  void take_control_of_no_time(const Tag& tag);
  void break_clock();
  void settle_suspect(std::int64_t next_ps);
  void settle_last_suspect();
  bool comes_late(std::int64_t time_ps);
  bool is_early(std::int64_t time_ps);
  void admit(const Tag& tag);
  void jump_gap(std::int64_t time_ps);
  void reach(std::int64_t time_ps, std::int64_t patience_ps);

  void place(const Tag& tag);
  bool place_photon(const Tag& tag);
  void place_surplus_photon(std::int64_t time_ps);

  void begin_frame(std::int64_t start_ps, Ends ends);
  void keep_last_photons();
  void move_start(std::int64_t start_ps);
  void anchor(std::int64_t sync_ps);
  void fix_end();
  [[nodiscard]] std::int64_t end_by_grid(const SyncFit& grid) const;
  [[nodiscard]] std::int64_t end_by_last_sync() const;
  void next_frame();
  void close_frame();
  void cut_short();
  [[nodiscard]] std::int64_t reached_ps() const;

  void end_loss(std::int64_t time_ps, std::int32_t count);
  void report(std::int64_t count);
  void lose(std::uint64_t count);
  void lose_uncounted();
  void diagnose();

  FramerOptions options_;
  ChannelMap channels_;
  FrameSink& sink_;
  SyncClock clock_;
  TimingWalk walk_;
  FixedArray<Tag> corrected_;  // scratch: tags without their inputs' delays and walk
  Silence silence_;
  std::int64_t max_gap_ps_;   // a longer gap makes no empty frames
  std::int64_t disorder_ps_;  // how far tags may be out of order

  Frame* frame_ = nullptr;                              // the open frame
  std::vector<FixedArray<std::int64_t>> last_photons_;  // of the stream so far, of each pixel
  Frame* spare_ = nullptr;  // a frame opened but not used at the end of the stream before
  Ends ends_ = Ends::neither;
  double periods_ = 0;           // pattern periods in the frame
  std::int64_t nominal_ps_ = 0;  // length of these periods, by the best known period
  std::int64_t limit_ps_ = 0;    // times in [start, limit) are in the frame; once placed, its end
  std::int64_t last_ps_ = 0;     // time of the last tag
  std::int64_t arrival_ns_ = 0;  // of the tags being pushed
  std::uint64_t sequence_ = 0;

  std::optional<Tag> suspect_;  // a tag far ahead of the tag before it, not yet believed
  FixedArray<Tag> held_;        // tags of the next frame, while the open frame waits for late tags
  int backward_run_ = 0;        // tags in a row that were earlier than the frame
  int beyond_run_ = 0;          // events in a row beyond the range; counted up to 16
  std::int64_t beyond_ps_ = 0;  // the first such time since the last frame was closed
  std::optional<std::int64_t> loss_from_ps_;     // a loss_begin without its end
  std::int64_t loss_floor_ps_ = 0;               // how far a loss_end alone reaches back
  std::optional<std::int64_t> surplus_from_ps_;  // first photon for which there was no room
  std::uint64_t surplus_photons_ = 0;            // of the open frame

  PixelRooms rooms_;
  std::int64_t dwell_end_ps_ = 0;  // of the last dwell; valid once there was one

  FramerTotals totals_;
  std::uint64_t unplaced_uncounted_ = 0;  // uncounted losses while no frame is open
  int unlocked_frames_ = 0;
  std::optional<SyncDiagnosis> diagnosis_;
};

}  // namespace splid
