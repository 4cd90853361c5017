#include "daemon/stream/encoder_join.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr double ps_per_s = 1e12;
constexpr std::int64_t pause_ps = 100'000'000'000;
constexpr double early_or_late = 0.25;
constexpr double most_ahead_s = 2;

constexpr std::int64_t counter_turn = std::int64_t{1} << 32;

// What a counter of 32 bits misses that has passed its end between two values; 0: it has not. No
// encoder moves by half of such a counter's range between two samples.
std::int64_t passed_between(std::int64_t before, std::int64_t after) {
  constexpr std::int64_t half = counter_turn / 2;
  const std::int64_t step = saturated_difference(after, before);
  if (step < -half && step > -3 * half) return counter_turn;
  return step > half && step < 3 * half ? -counter_turn : 0;
}

// The most counts that may wait for their markers: an hour at 1 kHz. By then no marker will come.
constexpr std::size_t most_waiting = 1 << 22;

// How many starts of the sample clock the counts may be ahead of the markers. Markers follow within
// a second, and starts are at least 0.1 s apart.
constexpr std::int64_t most_runs_ahead = 16;

}  // namespace

void EncoderJoin::take_frame(std::int64_t start_ps, std::int64_t end_ps,
                             std::span<const std::int64_t> markers_ps,
                             std::span<const Loss> losses) {
  const bool follows = has_frame_ && start_ps == end_ps_;
  if (!follows) quiet_since_ps_ = start_ps;
  has_frame_ = true;
  start_ps_ = start_ps;
  end_ps_ = end_ps;
  times_ps_.clear();
  std::vector<std::int64_t> sorted_ps(markers_ps.begin(), markers_ps.end());
  std::sort(sorted_ps.begin(), sorted_ps.end());
  auto loss = losses.begin();
  for (const std::int64_t time_ps : sorted_ps) {
    for (; loss != losses.end() && loss->begin_ps <= time_ps; ++loss) {
      quiet_since_ps_ = std::max(quiet_since_ps_, std::min(loss->end_ps, time_ps));
    }
    take_marker(time_ps);
  }
  for (; loss != losses.end(); ++loss) quiet_since_ps_ = std::max(quiet_since_ps_, loss->end_ps);
  forget_old_counts();
}

void EncoderJoin::take_marker(std::int64_t time_ps) {
  const bool is_start = saturated_difference(time_ps, quiet_since_ps_) >= pause_ps;
  if (is_start || !last_ps_) {
    ++marker_run_;
    marker_broken_ = !is_start;
    run_start_ps_ = time_ps;
    next_index_ = 0;
    times_ps_.clear();
  } else if (!is_regular(time_ps)) {
    marker_broken_ = true;
    const std::int64_t since_ps = saturated_difference(time_ps, *last_ps_);
    lost_step_ = lost_step_ || since_ps >= pause_ps || since_ps < 0;
  }
  times_ps_.push_back(time_ps);
  ++next_index_;
  last_ps_ = quiet_since_ps_ = time_ps;
}

bool EncoderJoin::is_regular(std::int64_t time_ps) const {
  const std::int64_t since_ps = saturated_difference(time_ps, *last_ps_);
  if (marker_broken_ || next_index_ < 2) return since_ps > 0 && since_ps < pause_ps;
  const double gap_ps =
      static_cast<double>(*last_ps_ - run_start_ps_) / static_cast<double>(next_index_ - 1);
  return std::abs(static_cast<double>(since_ps) - gap_ps) <= early_or_late * gap_ps;
}

// A value in the upper half of the counter's range, of a counter that then passes its end upwards,
// was below 0: so are the counts of the run that still wait.
void EncoderJoin::Run::add(std::int64_t value) {
  if (!first_value) first_value = last_value = value;
  const std::int64_t more = passed_between(last_value, value);
  if (more > 0 && passed == 0 && *first_value >= counter_turn / 2) {
    for (std::int64_t& count : counts) count = saturated_difference(count, counter_turn);
    passed = -counter_turn;
  }
  passed = saturated_sum(passed, more);
  last_value = value;
  counts.push_back(saturated_sum(value, passed));
}

void EncoderJoin::take_counts(const EncoderBatch& batch) {
  if (batch.overrun && count_run_ > 0) runs_[count_run_].whole = false;
  if (batch.counts.empty()) return;
  const std::int64_t first = batch.first_index;
  if (count_run_ == 0 || first == 0 || first < expected_index_) {
    runs_[++count_run_].whole = first == 0;
  } else if (first != expected_index_) {
    runs_[count_run_].whole = false;
  }
  expected_index_ = saturated_sum(first, static_cast<std::int64_t>(batch.counts.size()));
  if (live_ && count_run_ - marker_run_ > most_runs_ahead) lost_step_ = true;
  if (lost_step_) runs_.clear();  // none of them is ever used again
  if (count_run_ < marker_run_) runs_.erase(count_run_);
  const auto found = runs_.find(count_run_);
  if (found == runs_.end() || !found->second.whole) return;
  std::deque<std::int64_t>& counts = found->second.counts;
  for (const std::int64_t count : batch.counts) found->second.add(count);
  if (waiting() > most_waiting) {
    found->second.whole = false;
    counts.clear();
  }
  if (!live_ || count_run_ != marker_run_ || next_index_ < 2) return;
  const auto more = static_cast<double>(expected_index_ - next_index_);
  const double run_s = static_cast<double>(*last_ps_ - run_start_ps_) / ps_per_s;
  lost_step_ = more * run_s > most_ahead_s * static_cast<double>(next_index_ - 1);
}

std::size_t EncoderJoin::waiting() const {
  std::size_t count = 0;
  for (const auto& [number, run] : runs_) count += run.counts.size();
  return count;
}

// Forgets the runs before the run of the markers, and the counts before the frame.
void EncoderJoin::forget_old_counts() {
  runs_.erase(runs_.begin(), runs_.lower_bound(marker_run_));
  const auto found = runs_.find(marker_run_);
  if (found == runs_.end()) return;
  Run& run = found->second;
  const std::int64_t needed = next_index_ - static_cast<std::int64_t>(times_ps_.size());
  const auto passed = std::clamp<std::int64_t>(needed - run.first_index, 0,
                                               static_cast<std::int64_t>(run.counts.size()));
  run.counts.erase(run.counts.begin(), run.counts.begin() + passed);
  run.first_index += passed;
}

const EncoderJoin::Run* EncoderJoin::run() const {
  const auto found = runs_.find(marker_run_);
  return found == runs_.end() ? nullptr : &found->second;
}

bool EncoderJoin::waits() const {
  if (lost_step_ || marker_broken_ || times_ps_.empty()) return false;
  const Run* counts = run();
  if (counts == nullptr) return count_run_ < marker_run_;
  const auto known = counts->first_index + static_cast<std::int64_t>(counts->counts.size());
  return counts->whole && count_run_ == marker_run_ && known < next_index_;
}

std::optional<EncoderPosition> EncoderJoin::position() const {
  const Run* counts = run();
  if (lost_step_ || marker_broken_ || counts == nullptr || !counts->whole) return std::nullopt;
  const auto samples = static_cast<std::int64_t>(times_ps_.size());
  const std::int64_t skipped = next_index_ - samples - counts->first_index;
  if (samples < 2 || skipped < 0 ||
      skipped + samples > static_cast<std::int64_t>(counts->counts.size())) {
    return std::nullopt;
  }
  if (2 * (times_ps_.back() - times_ps_.front()) < end_ps_ - start_ps_) return std::nullopt;
  // Times are relative to mid-frame and counts to the first count, so that no digit is lost.
  const std::int64_t mid_ps = start_ps_ + (end_ps_ - start_ps_) / 2;
  const std::int64_t first_count = counts->counts[static_cast<std::size_t>(skipped)];
  double sum_t = 0;
  double sum_n = 0;
  double sum_tt = 0;
  double sum_tn = 0;
  for (std::int64_t i = 0; i < samples; ++i) {
    const double t =
        static_cast<double>(times_ps_[static_cast<std::size_t>(i)] - mid_ps) / ps_per_s;
    const auto n = static_cast<double>(
        saturated_difference(counts->counts[static_cast<std::size_t>(skipped + i)], first_count));
    sum_t += t;
    sum_n += n;
    sum_tt += t * t;
    sum_tn += t * n;
  }
  const auto number = static_cast<double>(samples);
  const double slope = (number * sum_tn - sum_t * sum_n) / (number * sum_tt - sum_t * sum_t);
  const double at_mid = (sum_n - slope * sum_t) / number;
  return EncoderPosition{
      scale_.offset_m + scale_.m_per_count * (static_cast<double>(first_count) + at_mid),
      scale_.m_per_count * slope};
}

std::string EncoderJoin::fault() const {
  if (lost_step_) {
    return "the encoder's markers and counts are out of step; stop its sample clock, start splid "
           "anew, then the clock";
  }
  if (marker_run_ > 0 && marker_broken_) {
    return "the encoder's markers have a gap, or began before they were watched; stop its sample "
           "clock for more than 0.1 s and start it again";
  }
  const Run* counts = run();
  if (marker_run_ > 0 && counts != nullptr && !counts->whole) {
    return "the encoder's counts have a gap, or do not begin with index 0; stop its sample clock "
           "for more than 0.1 s and start it again";
  }
  return {};
}

}  // namespace splid
