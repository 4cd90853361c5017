#include "daemon/stream/framer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/model/units.hpp"
#include "estimator/sync/sync_survey.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::int64_t second_ps = 1'000'000'000'000;
constexpr int frames_without_tags = 20;
constexpr std::int64_t disorder_ps = 1'000'000;
constexpr int backward_tags = 16;
constexpr std::size_t most_corrected = 4096;
constexpr std::uint64_t most_beyond = 1 << 20;  // in a frame, where a clock stands at its end
constexpr std::size_t most_held = 4096;  // if more tags come within 1 us, the frame closes at once

// Design note: the frame's end is placed when 99 % of the frame has passed, by a line through its
// syncs so far. The line then has to be extended by only 1 % of the frame (an error of 0.2 ps with
// 10 ps of jitter and 13,000 syncs), and for each tag of the last 1 % it is known at once which
// frame it belongs to.
constexpr double end_fixed_at = 0.99;

// Design note: times within 2^54 ps (5 h) of the largest and smallest 64-bit numbers are taken for
// stray time stamps, so that the arithmetic with ends and gaps cannot overflow.
constexpr std::int64_t max_time_ps =
    std::numeric_limits<std::int64_t>::max() - (std::int64_t{1} << 54);

bool in_range(std::int64_t time_ps) { return time_ps < max_time_ps && time_ps > -max_time_ps; }

std::int64_t to_ps(double value) { return std::llround(value); }

}  // namespace

Framer::Framer(const FramerOptions& options, const ChannelMap& channels, FrameSink& sink)
    : options_(options),
      channels_(channels),
      sink_(sink),
      clock_(options.period_ps, options.drift, options.max_syncs),
      walk_(options.walk, channels.inputs()),
      corrected_(corrects() ? most_corrected : 0),
      held_(most_held),
      rooms_(channels.pixels()) {
  for (std::size_t i = 0; i < std::max<std::size_t>(channels.pixels(), 1); ++i) {
    last_photons_.emplace_back(Frame::most_before);
  }
  const double length_ps =
      periods_per_frame(options.length_ms, options.period_ps) * options.period_ps;
  nominal_ps_ = to_ps(length_ps);
  max_gap_ps_ = std::max(second_ps, frames_without_tags * to_ps(length_ps));
  if (options.scan) max_gap_ps_ = max_time_ps;  // a dwell may be dark for as long as it lasts
  // In a very short frame the last per cent may be shorter than 1 us. Then tags of the next frame
  // could come before the end of this frame is placed, so the allowed disorder is less too.
  disorder_ps_ = std::min(disorder_ps, to_ps(length_ps / 400));
}

void Framer::push(std::span<const Tag> tags, std::int64_t arrival_ns) {
  arrival_ns_ = arrival_ns;
  if (!corrects()) return push_in_time(tags);
  while (!tags.empty()) {
    const auto some = tags.first(std::min(tags.size(), most_corrected));
    corrected_.clear();
    for (const Tag& tag : some) corrected_.push(corrected(tag));
    push_in_time(corrected_.view());
    tags = tags.subspan(some.size());
  }
}

Tag Framer::corrected(const Tag& tag) {
  Tag photon = channels_.undelayed(tag);
  if (walk_.is_none() || channels_.roles(tag) != role_photon) return photon;
  photon.time_ps = walk_.without(photon.time_ps, channels_.input(tag));
  return photon;
}

void Framer::take(const Tag& tag) {
  if ((channels_.roles(tag) & role_control) != 0) {
    take_control(tag);
    return;
  }
  ++totals_.events;
  if (!in_range(tag.time_ps)) {
    take_beyond(tag.time_ps);
    return;
  }
  beyond_run_ = 0;
  if (comes_late(tag.time_ps)) {
    ++totals_.late;
    lose(1);
    return;
  }
  if (tag.time_ps >= limit_ps_ && saturated_difference(tag.time_ps, last_ps_) > disorder_ps_) {
    suspect_ = tag;
  } else {
    admit(tag);
  }
}

void Framer::take_beyond(std::int64_t time_ps) {
  ++totals_.late;
  lose(1);
  if (beyond_run_ < backward_tags) {
    if (++beyond_run_ < backward_tags) return;
    break_clock();
    beyond_ps_ = time_ps;
    return;
  }
  ++totals_.beyond;
  const bool over = saturated_difference(time_ps, beyond_ps_) >= nominal_ps_ ||
                    saturated_difference(beyond_ps_, time_ps) >= nominal_ps_;
  if (!over && totals_.unplaced < most_beyond) return;
  beyond_ps_ = time_ps;
  close_beyond();
}

// A frame for what was lost beyond the range, so that who listens hears of it.
void Framer::close_beyond() {
  begin_frame(beyond_ps_ > 0 ? max_time_ps : -max_time_ps, Ends::neither);
  frame_->add_loss(frame_->start_ps, frame_->start_ps + nominal_ps_, 0);
  cut_short();
}

void Framer::take_control(const Tag& tag) {
  if (tag.kind == TagKind::clock_break) {
    break_clock();
    return;
  }
  if (!in_range(tag.time_ps)) {
    take_control_of_no_time(tag);
    return;
  }
  const bool early = comes_late(tag.time_ps);
  if (tag.kind == TagKind::heartbeat) {
    if (early) return;
    if (saturated_difference(tag.time_ps, last_ps_) > max_gap_ps_) {
      suspect_ = tag;
    } else {
      reach(tag.time_ps, disorder_ps_);
    }
    return;
  }
  const std::int64_t before_ps = last_ps_;
  if (!early) reach(tag.time_ps, 0);
  if (tag.kind == TagKind::loss_begin) {
    if (!loss_from_ps_) loss_from_ps_ = std::max(tag.time_ps, frame_->start_ps);
  } else if (tag.kind == TagKind::loss_end) {
    end_loss(tag.time_ps, tag.value);
  } else {
    frame_->add_loss(before_ps, tag.time_ps, tag.value);
    report(tag.value);
  }
}

// Takes a control tag whose time is impossible. Its count is still good; if a loss is open, a
// loss_end ends that loss at the last tag.
void Framer::take_control_of_no_time(const Tag& tag) {
  if (tag.kind == TagKind::loss_end && loss_from_ps_) {
    end_loss(last_ps_, tag.value);
  } else if (tag.kind == TagKind::loss_end || tag.kind == TagKind::missed) {
    report(tag.value);
  }
}

// The tagger's clock was set anew: the open frame and the open loss end with the old clock.
void Framer::break_clock() {
  settle_last_suspect();
  if (loss_from_ps_) lose_uncounted();
  if (frame_ != nullptr) cut_short();
  loss_from_ps_.reset();
  ++totals_.resets;
}

// Decides on the suspect, a tag far ahead: it is real if the next tag is that far ahead too.
void Framer::settle_suspect(std::int64_t next_ps) {
  if (!suspect_) return;
  const Tag tag = *suspect_;
  suspect_.reset();
  const bool real = saturated_difference(tag.time_ps, next_ps) <= disorder_ps_;
  if (tag.kind == TagKind::heartbeat) {
    if (real) reach(tag.time_ps, disorder_ps_);
  } else if (real) {
    admit(tag);
  } else {
    ++totals_.late;
    lose(1);
  }
}

// Decides on the suspect when no tag comes after it: it is real unless it is so far ahead that it
// would make a jump.
void Framer::settle_last_suspect() {
  if (!suspect_) return;
  const bool near = saturated_difference(suspect_->time_ps, last_ps_) <= max_gap_ps_;
  settle_suspect(near ? suspect_->time_ps : last_ps_);
}

// Whether a tag is before the open frame. Where it is not, the tag first decides on the suspect.
// The decision may begin a new frame; the tag is then compared with the new frame.
bool Framer::comes_late(std::int64_t time_ps) {
  if (is_early(time_ps)) return true;
  settle_suspect(time_ps);
  return is_early(time_ps);
}

// Whether a tag is before the open frame; such a tag does not decide on the suspect. Where no frame
// is open, and where 16 tags in a row were before the open frame, a new frame begins at this tag.
bool Framer::is_early(std::int64_t time_ps) {
  if (frame_ == nullptr) begin_frame(time_ps, Ends::neither);
  if (time_ps >= frame_->start_ps) return false;
  if (ends_ == Ends::neither && saturated_difference(frame_->start_ps, time_ps) <= disorder_ps_) {
    frame_->start_ps = time_ps;  // the first tags of the stream are out of order
    return false;
  }
  if (++backward_run_ < backward_tags) return true;
  break_clock();
  begin_frame(time_ps, Ends::neither);
  return false;
}

void Framer::admit(const Tag& tag) {
  jump_gap(tag.time_ps);
  if (ends_ == Ends::neither && (channels_.roles(tag) & role_sync) != 0) anchor(tag.time_ps);
  reach(tag.time_ps, disorder_ps_);
  if (tag.time_ps < limit_ps_) {
    place(tag);
  } else if (!held_.push(tag)) {
    next_frame();
    place(tag);
  }
}

void Framer::jump_gap(std::int64_t time_ps) {
  if (saturated_difference(time_ps, last_ps_) <= max_gap_ps_) return;
  cut_short();
  ++totals_.jumps;
  begin_frame(time_ps, Ends::neither);
}

// The stream has come to time_ps: closes every frame that ended patience_ps before it or earlier.
void Framer::reach(std::int64_t time_ps, std::int64_t patience_ps) {
  jump_gap(time_ps);
  while (time_ps >= limit_ps_) {
    if (ends_ != Ends::both) {
      fix_end();
    } else if (time_ps - limit_ps_ < patience_ps) {
      break;
    } else {
      next_frame();
    }
  }
  backward_run_ = 0;
  last_ps_ = time_ps;
}

void Framer::place(const Tag& tag) {
  const Roles roles = channels_.roles(tag);
  frame_->arrival_ns = arrival_ns_;
  int uses = 0;
  if ((roles & role_photon) != 0 && place_photon(tag)) {
    ++uses;
    ++totals_.photons;
  } else if (roles == role_photon) {
    place_surplus_photon(tag.time_ps);
    return;
  }
  if ((roles & role_sync) != 0 && frame_->syncs_ps.push(tag.time_ps)) {
    ++uses;
    ++totals_.syncs;
  }
  if ((roles & role_marker) != 0 && frame_->markers.push({tag.time_ps, tag.value})) {
    ++uses;
    ++totals_.markers;
  }
  if (uses > 1) totals_.shared += static_cast<std::uint64_t>(uses - 1);
  if (uses > 0) return;
  if (roles == 0) {
    ++totals_.ignored;
  } else {
    ++totals_.surplus;
    lose(1);
  }
}

bool Framer::place_photon(const Tag& tag) {
  if (!rooms_.empty()) {
    rooms_.make_room(&tag, &tag + 1);
    return rooms_.rooms()[channels_.input(tag)].take(tag.time_ps, 1) == 0;
  }
  if (!frame_->photons_ps.push(tag.time_ps)) return false;
  if (!frame_->photons_of_input.empty()) ++frame_->photons_of_input[channels_.input(tag)];
  return true;
}

void Framer::place_surplus_photon(std::int64_t time_ps) {
  if (rooms_.empty() && !surplus_from_ps_) surplus_from_ps_ = time_ps;
  ++surplus_photons_;
  ++totals_.surplus;
  lose(1);
}

void Framer::begin_frame(std::int64_t start_ps, Ends ends) {
  if (ends == Ends::neither) last_ps_ = start_ps;
  frame_ = spare_ != nullptr ? spare_ : &sink_.open();
  spare_ = nullptr;
  frame_->sequence = sequence_;
  frame_->scan.reset();
  frame_->photons_ps.clear();
  frame_->syncs_ps.clear();
  frame_->markers.clear();
  frame_->losses.clear();
  const bool counts_inputs =
      rooms_.empty() && channels_.inputs() > 1 && channels_.inputs() <= Frame::most_inputs;
  frame_->photons_of_input.resize(counts_inputs ? channels_.inputs() : 0);
  std::fill(frame_->photons_of_input.begin(), frame_->photons_of_input.end(), 0);
  for (std::size_t i = 0; i < last_photons_.size(); ++i) {
    if (ends == Ends::neither) last_photons_[i].clear();  // no frame is right before this one
    Frame& part = rooms_.empty() ? *frame_ : *frame_->pixels[i];
    part.before_ps.clear();
    for (const std::int64_t photon_ps : last_photons_[i].view()) part.before_ps.push(photon_ps);
  }
  rooms_.open(*frame_);
  frame_->lost_tags = totals_.unplaced;
  frame_->uncounted_losses = unplaced_uncounted_;
  frame_->is_cut_off = false;
  frame_->arrival_ns = arrival_ns_;
  totals_.unplaced = unplaced_uncounted_ = 0;
  surplus_from_ps_.reset();
  surplus_photons_ = 0;
  ends_ = ends;
  loss_floor_ps_ = start_ps;
  if (loss_from_ps_) loss_from_ps_ = start_ps;
  periods_ = periods_per_frame(options_.length_ms, clock_.period_ps());
  nominal_ps_ = to_ps(periods_ * clock_.period_ps());
  move_start(start_ps);
}

void Framer::move_start(std::int64_t start_ps) {
  frame_->start_ps = start_ps;
  limit_ps_ = start_ps + to_ps(end_fixed_at * static_cast<double>(nominal_ps_));
}

// Takes the first sync of the stream: the frame's start is placed a whole number of periods before
// the sync, at or before the frame's first tag. The time between the start and that first tag is a
// loss, since nobody knows whether the instrument was listening.
void Framer::anchor(std::int64_t sync_ps) {
  const std::int64_t first_ps = std::min(frame_->start_ps, sync_ps);
  const double period_ps = clock_.period_ps();
  const double before = std::ceil(static_cast<double>(sync_ps - first_ps) / period_ps);
  ends_ = Ends::start;
  move_start(sync_ps - to_ps(before * period_ps));
  frame_->start_ps = std::min(frame_->start_ps, first_ps);
  limit_ps_ = std::max(limit_ps_, reached_ps());  // tags already in the frame stay in it
  frame_->add_loss(frame_->start_ps, first_ps, 0);
}

void Framer::fix_end() {
  const SyncFit grid =
      clock_.fit(frame_->syncs_ps.view(), frame_->start_ps, std::max(limit_ps_, last_ps_ + 1));
  frame_->end_ps = grid.locked ? end_by_grid(grid) : end_by_last_sync();
  limit_ps_ = frame_->end_ps;
  ends_ = Ends::both;
}

// The frame's end from a fit of its syncs: the pattern start that lies the frame's number of
// periods after its start. Where the frame has taken tags that are later, the first pattern start
// after those tags. So a frame that did not begin at a pattern start still ends at one.
std::int64_t Framer::end_by_grid(const SyncFit& grid) const {
  const auto index = [&](std::int64_t time_ps) {
    return (static_cast<double>(time_ps - grid.origin_ps) - grid.phase_ps) / grid.period_ps;
  };
  const std::int64_t taken_ps = std::max(limit_ps_, last_ps_ + disorder_ps_ + 1);
  const double periods = periods_per_frame(options_.length_ms, grid.period_ps);
  const double end =
      std::max(std::round(index(frame_->start_ps) + periods), std::ceil(index(taken_ps)));
  return grid.origin_ps + to_ps(grid.phase_ps + end * grid.period_ps);
}

// The frame's end where its syncs cannot be fitted. Pattern starts are counted from the last sync,
// and the frame ends at the pattern start nearest to its nominal end. If that start is further from
// the nominal end than 500 ppm of clock drift can explain, the frame ends at the nominal end. So
// frames with one or two syncs still end at pattern starts.
std::int64_t Framer::end_by_last_sync() const {
  constexpr double max_drift = 500e-6;
  const std::int64_t taken_ps = std::max(limit_ps_, last_ps_ + disorder_ps_ + 1);
  const std::int64_t nominal_ps = std::max(frame_->start_ps + nominal_ps_, taken_ps);
  if (frame_->syncs_ps.empty()) return nominal_ps;
  const std::int64_t sync_ps = frame_->syncs_ps[frame_->syncs_ps.size() - 1];
  const double period_ps = clock_.period_ps();
  const double periods = std::round(static_cast<double>(nominal_ps - sync_ps) / period_ps);
  const std::int64_t end_ps = sync_ps + to_ps(periods * period_ps);
  const double off_ps = std::abs(static_cast<double>(end_ps - nominal_ps));
  const bool near = off_ps <= max_drift * static_cast<double>(nominal_ps_);
  return near && end_ps >= taken_ps ? end_ps : nominal_ps;
}

// The next frame is to know the photons that its detector may still be dead from.
void Framer::keep_last_photons() {
  rooms_.settle();
  for (std::size_t i = 0; i < last_photons_.size(); ++i) {
    FixedArray<std::int64_t>& last = last_photons_[i];
    const auto photons = (rooms_.empty() ? *frame_ : *frame_->pixels[i]).photons_ps.view();
    const std::size_t new_ones = std::min(photons.size(), Frame::most_before);
    const std::size_t surplus =
        last.size() + new_ones - std::min(last.size() + new_ones, Frame::most_before);
    std::copy(last.begin() + surplus, last.end(), last.begin());
    last.resize(last.size() - surplus);
    for (const std::int64_t photon_ps : photons.last(new_ones)) last.push(photon_ps);
  }
}

void Framer::next_frame() {
  const std::int64_t end_ps = frame_->end_ps;
  keep_last_photons();
  close_frame();
  begin_frame(end_ps, Ends::start);
  for (const Tag& tag : held_.view()) place(tag);
  held_.clear();
}

void Framer::close_frame() {
  rooms_.settle();
  if (loss_from_ps_) frame_->add_loss(*loss_from_ps_, frame_->end_ps, 0);
  if (surplus_from_ps_) frame_->add_loss(*surplus_from_ps_, frame_->end_ps, surplus_photons_);
  frame_->settle_losses();
  frame_->sync = clock_.fit(frame_->syncs_ps.view(), frame_->start_ps, frame_->end_ps);
  for (std::size_t n = silence_.mark(*frame_, clock_.period_ps()); n > 0; --n) lose_uncounted();
  diagnose();
  rooms_.share();
  ++sequence_;
  ++totals_.frames;
  frame_ = nullptr;
  sink_.close();
}

// Closes the frame before its end is reached; the time that the stream did not reach is a loss.
void Framer::cut_short() {
  if (!held_.empty()) next_frame();
  if (ends_ != Ends::both) fix_end();
  frame_->add_loss(reached_ps(), frame_->end_ps, 0);
  close_frame();
}

std::int64_t Framer::reached_ps() const {
  rooms_.settle();
  std::int64_t latest_ps = last_ps_;
  const auto include = [&](const Frame& part) {
    for (const std::int64_t time_ps : part.photons_ps.view()) {
      latest_ps = std::max(latest_ps, time_ps);
    }
  };
  include(*frame_);
  for (const auto& pixel : frame_->pixels) include(*pixel);
  for (const MarkerTag& marker : frame_->markers.view()) {
    latest_ps = std::max(latest_ps, marker.time_ps);
  }
  return latest_ps + 1;
}

void Framer::finish() {
  settle_last_suspect();
  if (frame_ == nullptr && std::exchange(beyond_run_, 0) == backward_tags) close_beyond();
  if (frame_ == nullptr) return;
  if (!held_.empty()) next_frame();
  rooms_.settle();
  const bool used = frame_->photon_count() > 0 || !frame_->syncs_ps.empty() ||
                    !frame_->markers.empty() || frame_->lost_tags > 0 ||
                    frame_->uncounted_losses > 0;
  if (used) {
    if (loss_from_ps_) lose_uncounted();
    frame_->is_cut_off = true;
    cut_short();
  } else {
    spare_ = frame_;
    frame_ = nullptr;
  }
  loss_from_ps_.reset();
}

void Framer::push_dwell(const ScanPlace& place, std::int64_t start_ps, std::int64_t end_ps,
                        std::span<const Tag> tags, std::int64_t arrival_ns) {
  arrival_ns_ = arrival_ns;
  const bool follows = totals_.frames > 0 && dwell_end_ps_ == start_ps;
  begin_frame(start_ps, follows ? Ends::start : Ends::neither);
  frame_->scan = place;
  last_ps_ = start_ps;
  frame_->end_ps = limit_ps_ = dwell_end_ps_ = end_ps;
  ends_ = Ends::both;
  push_in_time(tags);
  keep_last_photons();
  close_frame();
}

void Framer::outside(const Tag& tag) {
  switch (tag.kind) {
    case TagKind::photon:
    case TagKind::sync:
    case TagKind::marker:
      ++totals_.events;
      ++(channels_.roles(tag) == 0 ? totals_.ignored : totals_.outside);
      return;
    case TagKind::loss_begin:
      if (!loss_from_ps_) loss_from_ps_ = tag.time_ps;
      return;
    case TagKind::loss_end:
      loss_from_ps_.reset();
      return report(tag.value);
    case TagKind::missed:
      return report(tag.value);
    case TagKind::clock_break:
      return break_clock();
    case TagKind::heartbeat:
      return;
  }
}

void Framer::end_loss(std::int64_t time_ps, std::int32_t count) {
  frame_->add_loss(loss_from_ps_.value_or(loss_floor_ps_), time_ps, count);
  loss_from_ps_.reset();
  loss_floor_ps_ = std::max(loss_floor_ps_, time_ps);
  report(count);
}

// Counts the tags of a loss that the stream itself reports; -1: their number is not known.
void Framer::report(std::int64_t count) {
  if (count < 0) lose_uncounted();
  if (count <= 0) return;
  totals_.reported += static_cast<std::uint64_t>(count);
  lose(static_cast<std::uint64_t>(count));
}

void Framer::lose(std::uint64_t count) {
  (frame_ != nullptr ? frame_->lost_tags : totals_.unplaced) += count;
}

void Framer::lose_uncounted() {
  ++totals_.uncounted;
  ++(frame_ != nullptr ? frame_->uncounted_losses : unplaced_uncounted_);
}

// Looks for the reason why frames do not lock, once three frames did not: a single frame may not
// lock because it began in mid-stream.
void Framer::diagnose() {
  constexpr int frames_enough = 3;
  constexpr std::size_t syncs_enough = 16;
  if (unlocked_frames_ >= frames_enough) return;
  if (frame_->sync.locked) {
    unlocked_frames_ = frames_enough;
    return;
  }
  if (frame_->syncs_ps.size() < syncs_enough || ++unlocked_frames_ < frames_enough) return;
  diagnosis_ = SyncDiagnosis{options_.period_ps, find_sync_period_ps(frame_->syncs_ps.view()),
                             frame_->syncs_ps.size(),
                             static_cast<double>(frame_->end_ps - frame_->start_ps) / ps_per_ms};
}

}  // namespace splid
