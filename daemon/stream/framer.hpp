#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "daemon/stream/channel_map.hpp"
#include "daemon/stream/frame.hpp"
#include "daemon/stream/frame_plan.hpp"
#include "daemon/stream/silence.hpp"
#include "daemon/stream/sync_diagnosis.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Where every tag went. Each event (photon, sync, marker) pushed is counted once:
//   events = photons + syncs + markers - shared + ignored + late + surplus
// and every frame's lost_tags together, with unplaced: late + surplus + reported.
struct FramerTotals {
  std::uint64_t events = 0;
  std::uint64_t photons = 0;   // in frames
  std::uint64_t syncs = 0;     // in frames
  std::uint64_t markers = 0;   // in frames
  std::uint64_t shared = 0;    // uses of a tag beyond its first, for markers that came together
  std::uint64_t ignored = 0;   // on channels that the configuration does not name
  std::uint64_t late = 0;      // earlier than the open frame, or alone far ahead of it
  std::uint64_t surplus = 0;   // more than a frame can hold
  std::uint64_t reported = 0;  // missing as the stream itself says, known counts
  std::uint64_t unplaced = 0;  // lost while no frame is open: the next frame's, if one comes
  std::uint64_t frames = 0;
  std::uint64_t jumps = 0;      // gaps for which no frames were made
  std::uint64_t resets = 0;     // times the clock was set anew
  std::uint64_t uncounted = 0;  // losses of which nobody knows how many tags they took
};

// Cuts the stream of tags into frames: takes spans of tags in stream order, however cut, and emits
// closed frames. A frame is a whole number of pattern periods, the number that comes nearest to
// length_ms, in the tagger's clock; it starts and ends at pattern starts as the syncs tell them,
// and where the one before ended. Without syncs it has its nominal length and is not locked.
//
//  - It closes as soon as any tag or heartbeat is 1 us past its end; tags out of order by up to
//    that are in the frame they belong to. Later ones are counted (late) in the open frame.
//  - An event more than 1 us ahead of the tag before it and past the frame waits for the next tag
//    to be there too. So one stray time stamp far ahead costs that tag alone (late); two together
//    cost the open frame's rest, until 16 earlier tags in a row set the clock back.
//  - A gap of more than max(1 s, 20 frames) makes no empty frames: the open frame is closed with
//    the rest as a loss, and framing starts anew after it. A shorter one gives empty frames.
//  - 16 tags in a row before the open frame, or a clock_break: the clock was set anew. The frame is
//    closed likewise; the first 15 are late. A step back within the open frame is not seen.
//  - A loss is clipped to the frames that it touches; its count goes to the one in which it ends.
//    `missed` says no interval: it is taken as since the tag before. An end without a beginning
//    reaches back to the loss before, or to the frame's start. A loss that is open when the clock
//    is set anew ends there: its end may never come.
//  - Photons beyond the frame's room are counted (surplus), and the rest of the frame is a loss.
//  - Time in which an instrument says nothing although it should is a loss that nobody told of; see
//    Silence.
//
// Threads: one. Errors: none; FrameSink::open() may wait. No allocation after construction.
class Framer {
 public:
  Framer(const FramerOptions& options, const ChannelMap& channels, FrameSink& sink);

  // arrival_ns: when the tags came, any steady clock; ends up in Frame::arrival_ns. Photons are
  // taken without their input's delay; that may put them out of order by as much.
  void push(std::span<const Tag> tags, std::int64_t arrival_ns);
  // End of the stream: the last frame, if it holds or lost anything, with what was not reached as a
  // loss. Tags pushed afterwards start anew.
  void finish();

  [[nodiscard]] const FramerTotals& totals() const { return totals_; }
  // Set once three frames with 16 syncs or more did not lock before any frame did.
  [[nodiscard]] const std::optional<SyncDiagnosis>& diagnosis() const { return diagnosis_; }

 private:
  // What is known of the open frame's two ends.
  enum class Ends { neither, start, both };

  void push_in_time(std::span<const Tag> tags);
  // Each returns the first tag that it did not take.
  const Tag* store_run(const Tag* tag, const Tag* last);
  const Tag* skip_run(const Tag* tag, const Tag* last);
  void run_ended(std::size_t photons, std::size_t taken, const Tag* next);

  void take(const Tag& tag);
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
  void place_surplus_photon(std::int64_t time_ps);

  void begin_frame(std::int64_t start_ps, Ends ends);
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
  Silence silence_;
  std::int64_t max_gap_ps_;   // a longer one gives no empty frames
  std::int64_t disorder_ps_;  // tags may be out of order by so much

  Frame* frame_ = nullptr;  // the one being filled
  Frame* spare_ = nullptr;  // opened but not used, at the end of a stream
  Ends ends_ = Ends::neither;
  double periods_ = 0;           // pattern periods in the frame
  std::int64_t nominal_ps_ = 0;  // those, by the period best known
  std::int64_t limit_ps_ = 0;    // times in [start, limit) need no decision; with both ends: end
  std::int64_t last_ps_ = 0;     // time of the tag before
  std::int64_t arrival_ns_ = 0;  // of the tags being pushed
  std::uint64_t sequence_ = 0;

  std::optional<Tag> suspect_;  // far ahead of the tag before it
  FixedArray<Tag> undelayed_;   // scratch, where inputs have delays
  FixedArray<Tag> held_;        // of the next frame, while this one waits for disorderly tags
  int backward_run_ = 0;        // tags in a row that were earlier than the frame
  std::optional<std::int64_t> loss_from_ps_;     // a loss_begin without its end
  std::int64_t loss_floor_ps_ = 0;               // where an end without beginning reaches back to
  std::optional<std::int64_t> surplus_from_ps_;  // first photon for which there was no room
  std::uint64_t surplus_photons_ = 0;            // of this frame

  FramerTotals totals_;
  std::uint64_t unplaced_uncounted_ = 0;  // uncounted losses while no frame is open
  int unlocked_frames_ = 0;
  std::optional<SyncDiagnosis> diagnosis_;
};

}  // namespace splid
