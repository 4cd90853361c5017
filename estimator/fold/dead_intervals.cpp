#include "estimator/fold/dead_intervals.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr std::size_t most_begins = 1024;  // photons before the frame, and losses
constexpr double least_gap = 0.9;          // dead times between two detections
constexpr double few_early = 2, most_early_deviations = 0.1;
constexpr double most_hidden = 0.95;  // of the light of an input

using Times = std::span<const std::int64_t>;

std::size_t count_early(Times times_ps, std::int64_t least_gap_ps) {
  std::size_t early = 0;
  for (std::size_t i = 0; i + 1 < times_ps.size(); ++i) {
    early += times_ps[i + 1] - times_ps[i] < least_gap_ps ? 1 : 0;
  }
  return early;
}

double pairs_within(Times times_ps, std::int64_t apart_ps) {
  std::size_t first = 0, pairs = 0;
  for (std::size_t i = 0; i < times_ps.size(); ++i) {
    while (times_ps[i] - times_ps[first] >= apart_ps) ++first;
    pairs += i - first;
  }
  return static_cast<double>(pairs);
}

// The share of the light that a detection hides on average. hidden: the part of all light that
// comes within a dead time of one detection.
double blinded_share(std::span<const std::uint64_t> of_input, double photons, double hidden) {
  double light = 0, blinded = 0;
  for (const std::uint64_t count : of_input) {
    const auto c = static_cast<double>(count);
    const double of_this = c / (1 - std::min(c * hidden, most_hidden));
    light += of_this;
    blinded += c * of_this;
  }
  return blinded / (photons * light);
}

}  // namespace

DeadIntervals::DeadIntervals(const PulseTrain& train, double dead_time, std::size_t inputs,
                             std::size_t max_photons, double reach_ns)
    : ends(train, max_photons + most_begins, reach_ns),
      begins(train, most_begins, reach_ns),
      dead_time_ns(dead_time),
      share(1 / static_cast<double>(inputs)),
      even_share_(share),
      dead_time_ps_(std::llround(dead_time / ns_per_ps)) {
  times_ps_.reserve(max_photons);
  ends_ps_.reserve(max_photons + most_begins);
  begins_ps_.reserve(most_begins);
}

std::span<const std::int64_t> DeadIntervals::in_order(std::span<const std::int64_t> photons_ps) {
  if (std::is_sorted(photons_ps.begin(), photons_ps.end())) return photons_ps;
  times_ps_.assign(photons_ps.begin(), photons_ps.end());
  std::sort(times_ps_.begin(), times_ps_.end());
  return times_ps_;
}

// Of the light behind a detection the other inputs show their part: a pair of photons within a dead
// time is always one of two inputs. So the pairs within a dead time are the sum over all inputs of
// c_k f (sum of the other inputs' c), where light is steady or comes in weak pulses.
//
// Design note: f = dead time / time seen would leave out that most light comes in pulses, of which
// the first photon hides the others however short the dead time is.
void DeadIntervals::share_by_pairs(const FrameView& frame, std::span<const std::int64_t> times_ps) {
  share = even_share_;
  double photons = 0, across = 0;  // twice the pairs of photons on two inputs
  for (const std::uint64_t count : frame.photons_of_input) {
    const auto c = static_cast<double>(count);
    across += 2 * photons * c;
    photons += c;
  }
  if (even_share_ == 1 || !(photons > 0)) return;
  const double hidden = across > 0 ? pairs_within(times_ps, dead_time_ps_) / across : 0;
  share = blinded_share(frame.photons_of_input, photons, hidden);
}

bool DeadIntervals::find(const FrameView& frame, const PulseTrain& train) {
  const std::span<const std::int64_t> times_ps = in_order(frame.photons_ps);
  ends_ps_.clear();
  begins_ps_.clear();
  sum_ps_ = 0;
  next_loss_ = 0;
  const std::size_t early = count_early(
      times_ps, static_cast<std::int64_t>(least_gap * static_cast<double>(dead_time_ps_)));
  share_by_pairs(frame, times_ps);
  add_before(frame, times_ps.empty() ? frame.end_ps : times_ps.front());
  const std::size_t before = ends_ps_.size();
  if (frame.losses.empty()) ends_ps_.resize(before + times_ps.size());
  std::int64_t sum_ps = 0;
  for (std::size_t i = 0; i < times_ps.size(); ++i) {
    // With a single input the next photon ends the dead time at the latest.
    const bool is_cut = share == 1 && i + 1 < times_ps.size();
    const std::int64_t to_ps =
        std::min(times_ps[i] + dead_time_ps_, is_cut ? times_ps[i + 1] : frame.end_ps);
    if (frame.losses.empty()) {
      ends_ps_[before + i] = to_ps;
      sum_ps += to_ps - times_ps[i];
    } else {
      add(frame, times_ps[i], to_ps);
    }
  }
  sum_ps_ += sum_ps;
  dead_ns = static_cast<double>(sum_ps_) * ns_per_ps * share;
  FrameView edges = frame;
  edges.photons_ps = ends_ps_;
  ends.fold(edges, train);
  edges.photons_ps = begins_ps_;
  begins.fold(edges, train);
  const double most_early =
      few_early + most_early_deviations * std::sqrt(static_cast<double>(times_ps.size()));
  return (share < 1 || static_cast<double>(early) <= most_early) &&
         dead_ns <= most_blind * frame.seen_ns();
}

void DeadIntervals::straighten(const DeadIntervals& curved, double quadratic_ns,
                               const PulseTrain& train) {
  share = curved.share;
  dead_ns = curved.dead_ns;
  ends.straighten(curved.ends, quadratic_ns, train);
  begins.straighten(curved.begins, quadratic_ns, train);
}

// The dead time of the detections before the frame, as far as it reaches into the frame.
void DeadIntervals::add_before(const FrameView& frame, std::int64_t first_ps) {
  const std::int64_t latest_ps = share == 1 ? first_ps : frame.end_ps;
  std::int64_t last_ps = frame.start_ps;
  for (const std::int64_t photon_ps : frame.before_ps) {
    const std::int64_t to_ps = std::min(photon_ps + dead_time_ps_, latest_ps);
    if (to_ps <= frame.start_ps || photon_ps >= frame.start_ps) continue;
    if (share == 1) {
      last_ps = std::max(last_ps, to_ps);
    } else if (begins_ps_.size() < most_begins / 2) {
      begins_ps_.push_back(frame.start_ps);
      add(frame, frame.start_ps, to_ps);
    }
  }
  if (last_ps == frame.start_ps) return;
  begins_ps_.push_back(frame.start_ps);
  add(frame, frame.start_ps, last_ps);
}

// Adds the dead time [from, to) without its parts in losses; its begin has been noted. The begins
// ascend from call to call.
void DeadIntervals::add(const FrameView& frame, std::int64_t from_ps, std::int64_t to_ps) {
  while (next_loss_ < frame.losses.size() && frame.losses[next_loss_].end_ps <= from_ps) {
    ++next_loss_;
  }
  for (std::size_t k = next_loss_; k < frame.losses.size(); ++k) {
    const Loss& loss = frame.losses[k];
    if (loss.begin_ps >= to_ps) break;
    const std::int64_t until_ps = std::max(from_ps, loss.begin_ps);
    ends_ps_.push_back(until_ps);
    sum_ps_ += until_ps - from_ps;
    if (loss.end_ps >= to_ps) return;
    from_ps = loss.end_ps;
    begins_ps_.push_back(from_ps);
  }
  ends_ps_.push_back(to_ps);
  sum_ps_ += to_ps - from_ps;
}

}  // namespace splid
