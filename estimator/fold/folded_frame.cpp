#include "estimator/fold/folded_frame.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/fold/dead_intervals.hpp"
#include "estimator/fold/kernel_choice.hpp"
#include "estimator/model/units.hpp"

namespace splid {

FoldedFrame::FoldedFrame(const PulseTrain& train, std::size_t max_photons, double reach_ns)
    : reach_ns_(reach_ns) {
  for (auto* values : {&phase_ns, &time_ns}) values->reserve(max_photons);
  phase_32.reserve(max_photons);
  group_end.reserve(train.segments.size() + 1);
  if (train.single()) return;
  group_.reserve(max_photons);
  for (auto* values : {&phases_, &times_}) values->reserve(max_photons);
  phases_32_.reserve(max_photons);
}

void FoldedFrame::resize(std::size_t count) {
  for (auto* values : {&phase_ns, &time_ns}) values->resize(count);
  phase_32.resize(count);
}

// [P] Eq. 20: a time in the tagger's clock, over `scale`, is the time in the clock of the
// calibrated pattern. The line through the syncs gives the photon's phase, too.
//
// Design note: times are formed with whole picoseconds up to mid-frame, and are doubles from there
// on, so that an epoch of 3.4e17 ps costs no picosecond: those of a frame of 50 ms are exact.
void FoldedFrame::fold(const FrameView& frame, const PulseTrain& train) {
  resize(frame.photons_ps.size());
  const SyncFit& sync = frame.sync;
  const std::int64_t mid_ps = frame.mid_ps();
  scale = sync.period_ps * ns_per_ps / train.period_ns;
  const double to_ns = ns_per_ps / scale;
  const auto length_ps = static_cast<double>(frame.end_ps - frame.start_ps);
  length_ns = length_ps * to_ns;
  seen_ns = frame.seen_ns();
  const double start_phase_ps = static_cast<double>(sync.origin_ps - mid_ps) + sync.phase_ps -
                                sync.curvature_ps * sync.curvature_zero;
  const double turns_per_ps = 1 / sync.period_ps;
  best_search_kernels().fold(
      time_ns.data(), phase_ns.data(), phase_32.data(), frame.photons_ps.data(),
      {mid_ps, to_ns, turns_per_ps, start_phase_ps * turns_per_ps,
       sync.curvature_ps * turns_per_ps / (length_ps * length_ps / 4), train.period_ns},
      size());
  group_end.assign(1, size());
  if (!train.single()) group_by_segment(train);
}

void FoldedFrame::group_by_segment(const PulseTrain& train) {
  const std::size_t between = train.segments.size();
  group_.resize(size());
  group_end.assign(between + 1, 0);
  for (std::size_t i = 0; i < size(); ++i) {
    const PulseTrain::Place at = train.place_of(phase_ns[i]);
    const PulseTrain::Segment& segment = train.segments[at.segment];
    phase_32[i] = at.phase_32();
    const bool sure = segment.copies > 0 &&
                      phase_ns[i] - segment.begin_ns >= train.circle_ns + reach_ns_ &&
                      phase_ns[i] < segment.end_ns - reach_ns_;
    group_[i] = static_cast<std::uint8_t>(sure ? at.segment : between);
    ++group_end[group_[i]];
  }
  for (std::size_t k = 1; k <= between; ++k) group_end[k] += group_end[k - 1];

  phases_ = phase_ns;
  times_ = time_ns;
  phases_32_ = phase_32;
  std::vector<std::size_t>& next = group_end;  // groups are filled from their ends to their begins
  for (std::size_t i = size(); i-- > 0;) {
    const std::size_t to = --next[group_[i]];
    phase_ns[to] = phases_[i];
    time_ns[to] = times_[i];
    phase_32[to] = phases_32_[i];
  }
  std::rotate(next.begin(), next.begin() + 1, next.end());
  next.back() = size();
}

void FoldedFrame::begin_like(const FoldedFrame& other) {
  length_ns = other.length_ns;
  seen_ns = other.seen_ns;
  scale = other.scale;
  dead = nullptr;
  group_end.clear();
}

void FoldedFrame::copy_photon(std::size_t to, const FoldedFrame& from, std::size_t photon) {
  phase_ns[to] = from.phase_ns[photon];
  time_ns[to] = from.time_ns[photon];
  phase_32[to] = from.phase_32[photon];
}

void FoldedFrame::straighten(const FoldedFrame& curved, double quadratic_ns,
                             const PulseTrain& train) {
  begin_like(curved);
  group_end = curved.group_end;
  time_ns = curved.time_ns;
  phase_ns = curved.phase_ns;
  phase_32 = curved.phase_32;
  if (quadratic_ns == 0) return;
  const double share = 1 / length_ns;
  for (std::size_t group = 0; group < group_end.size(); ++group) {
    // The photons of the last group of several are taken by their phase alone.
    const std::size_t segment = std::min(group, train.segments.size() - 1);
    const double to_turns = 1 / train.segments[segment].comb.period_ns;
    for (std::size_t i = group_begin(group); i < group_end[group]; ++i) {
      const double shift = quadratic_ns * DelayTrack::quadratic_at(time_ns[i] * share);
      const double phase = phase_ns[i] - shift;
      phase_ns[i] = phase - train.period_ns * std::floor(phase / train.period_ns);
      const double turns = shift * to_turns;
      phase_32[i] -= static_cast<std::uint32_t>(
          static_cast<std::uint64_t>((turns - std::floor(turns)) * 0x1p32));
    }
  }
}

double FoldedFrame::dead_ns() const { return dead != nullptr ? dead->dead_ns : 0; }

void FoldedFrame::take_every(std::size_t step, const FoldedFrame& all) {
  begin_like(all);
  resize(all.size() / step + all.group_end.size());
  std::size_t taken = 0;
  for (std::size_t group = 0; group < all.group_end.size(); ++group) {
    for (std::size_t i = all.group_begin(group); i < all.group_end[group]; i += step) {
      copy_photon(taken++, all, i);
    }
    group_end.push_back(taken);
  }
  resize(taken);
}

// Design note: every photon is written, and the next one overwrites those that are left out. No
// branch depends on which these are, which takes a third of the time.
void FoldedFrame::take_some(std::span<const std::uint8_t> stays, const FoldedFrame& all) {
  begin_like(all);
  resize(all.size());
  std::size_t taken = 0;
  for (std::size_t group = 0; group < all.group_end.size(); ++group) {
    for (std::size_t i = all.group_begin(group); i < all.group_end[group]; ++i) {
      copy_photon(taken, all, i);
      taken += stays[i];
    }
    group_end.push_back(taken);
  }
  resize(taken);
}

}  // namespace splid
