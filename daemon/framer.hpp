#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "daemon/channel_map.hpp"
#include "daemon/frame.hpp"
#include "estimator/sync_clock.hpp"
#include "protocol/pattern.hpp"
#include "protocol/tag.hpp"

namespace splid {

struct FramerOptions {
  double length_ms = 50;  // > 0
  double period_ps = 0;   // of the pattern, in the tagger's clock where calibrated; > 0
  DriftMethod drift = DriftMethod::regression;
  std::size_t max_syncs = 1 << 16;  // that one frame can hold
};

// The frame's options for a pattern: its period (calibrated where it is), and room for its syncs.
FramerOptions framer_options(double length_ms, const Pattern& pattern, DriftMethod drift);

// Room for every tag that the ring can hold, and twice the syncs that the pattern sends.
FrameCapacity frame_capacity(double length_ms, const Pattern& pattern, std::size_t ring_capacity);

// Errors: Error(Fault::usage) where the syncs alone of a frame of length_ms, one a pattern period,
// do not fit into a ring of ring_capacity tags.
void check_frame_fits(double length_ms, const Pattern& pattern, std::size_t ring_capacity);

// Where every tag went. Each event (photon, sync, marker) pushed is counted once:
//   events = photons + syncs + markers - shared + ignored + late + surplus
// and every frame's lost_tags together: late + surplus + reported.
struct FramerTotals {
  std::uint64_t events = 0;
  std::uint64_t photons = 0;   // in frames
  std::uint64_t syncs = 0;     // in frames
  std::uint64_t markers = 0;   // in frames
  std::uint64_t shared = 0;    // both sync and marker
  std::uint64_t ignored = 0;   // on channels that the configuration does not name
  std::uint64_t late = 0;      // earlier than the open frame, or alone far ahead of it
  std::uint64_t surplus = 0;   // more than a frame can hold
  std::uint64_t reported = 0;  // missing as the stream itself says, known counts
  std::uint64_t frames = 0;
  std::uint64_t jumps = 0;   // gaps for which no frames were made
  std::uint64_t resets = 0;  // times the clock was set anew
};

// Why no frame locks although syncs come: they do not come at the pattern's period.
struct SyncDiagnosis {
  double pattern_period_ps = 0;
  std::optional<double> sync_period_ps;  // what fits the syncs; absent: nothing does
  std::size_t syncs = 0;                 // in the frame looked at
  double frame_ms = 0;
};

// In a sentence: both periods, by how much they differ, and what to do.
std::string describe(const SyncDiagnosis& diagnosis);

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
//    closed likewise; the 15 are late.
//  - A loss is clipped to the frames that it touches; its count goes to the one in which it ends.
//    `missed` says no interval: it is taken as since the tag before. An end without a beginning
//    reaches back to the loss before, or to the frame's start.
//  - Photons beyond the frame's room are counted (surplus), and the rest of the frame is a loss.
//
// Threads: one. Errors: none; FrameSink::open() may wait. No allocation after construction.
class Framer {
 public:
  Framer(const FramerOptions& options, const ChannelMap& channels, FrameSink& sink);

  // arrival_ns: when the tags came, any steady clock; ends up in Frame::arrival_ns.
  void push(std::span<const Tag> tags, std::int64_t arrival_ns);
  // End of the stream: the last frame, if it holds or lost anything, with what was not reached as a
  // loss. Tags pushed afterwards start anew.
  void finish();

  [[nodiscard]] const FramerTotals& totals() const { return totals_; }
  // Set once three frames with 16 syncs or more did not lock before any frame did.
  [[nodiscard]] const std::optional<SyncDiagnosis>& diagnosis() const { return diagnosis_; }

 private:
  enum class Sides { unanchored, start_known, end_known };

  const Tag* take_run(const Tag* tag, const Tag* last);
  const Tag* drop_run(const Tag* tag, const Tag* last);
  void take_slowly(const Tag& tag);
  void take_control(const Tag& tag);
  void take_event(const Tag& tag);
  void place(const Tag& tag, Role role);
  void place_sync(std::int64_t time_ps);
  void count_event(Role role);
  bool resolve_suspect(const Tag& next);
  bool is_late(const Tag& tag);
  void reach(std::int64_t time_ps, bool at_once);

  void begin_frame(std::int64_t start_ps, Sides sides);
  void set_start(std::int64_t start_ps);
  void fix_end();
  void close_frame();
  void next_frame();
  void cut_short();
  void replay_held();

  void begin_loss(std::int64_t time_ps);
  void end_loss(std::int64_t time_ps, std::int32_t count);
  void add_loss(std::int64_t begin_ps, std::int64_t end_ps, std::int64_t count);
  void lose(std::uint64_t count) { frame_->lost_tags += count; }
  void settle_losses();
  void diagnose();

  FramerOptions options_;
  const ChannelMap& channels_;
  FrameSink& sink_;
  SyncClock clock_;
  std::int64_t nominal_ps_;  // length by the period best known
  std::int64_t max_gap_ps_;

  Frame* frame_ = nullptr;  // the open one
  Sides sides_ = Sides::unanchored;
  std::int64_t limit_ps_ = 0;  // times in [start, limit) need no decision
  std::int64_t first_ps_ = 0;  // first tag of an unanchored frame
  std::int64_t last_ps_ = 0;   // time of the tag before
  std::int64_t arrival_ns_ = 0;
  std::uint64_t sequence_ = 0;

  std::optional<Tag> suspect_;
  int backward_run_ = 0;
  std::optional<std::int64_t> surplus_from_ps_;
  std::optional<std::int64_t> loss_from_ps_;
  std::optional<std::int64_t> last_loss_end_ps_;
  FixedArray<Tag> held_;  // of the next frame, while this one waits for the disorderly

  FramerTotals totals_;
  int unlocked_frames_ = 0;
  bool ever_locked_ = false;
  std::optional<SyncDiagnosis> diagnosis_;
};

}  // namespace splid
