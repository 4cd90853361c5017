#include "protocol/loss_collector.hpp"

#include <algorithm>
#include <iterator>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

// Design note: an input that no record can hold loses up to millions of tags a second, of each of
// which only the time is known. Kept apart to 1 ms they take at most a thousand entries a second,
// and 1 ms is a fiftieth of a frame.
constexpr std::int64_t missed_together_ps = 1'000'000'000;

std::int64_t length_ps(const Loss& loss) {
  return saturated_difference(loss.end_ps, loss.begin_ps);
}

// Design note: the time between two losses was seen. An interval over both would make a frame of
// that time incomplete, and would grow over all frames of a long recording with many short losses.
Loss joined(const Loss& a, const Loss& b) {
  const std::int64_t count = a.count < 0 || b.count < 0 ? -1 : saturated_sum(a.count, b.count);
  if (b.begin_ps <= a.end_ps) {
    return {std::min(a.begin_ps, b.begin_ps), std::max(a.end_ps, b.end_ps), count};
  }
  if (length_ps(b) > length_ps(a)) return {b.begin_ps - length_ps(a), b.end_ps, count};
  return {a.begin_ps, a.end_ps + length_ps(b), count};
}

void insert_sorted(const Loss& loss, std::vector<Loss>& losses) {
  const auto place =
      std::upper_bound(losses.begin(), losses.end(), loss,
                       [](const Loss& a, const Loss& b) { return a.begin_ps < b.begin_ps; });
  losses.insert(place, loss);
}

void join_narrowest_gap(std::vector<Loss>& losses) {
  const auto gap_before_ps = [&](std::size_t i) {
    return saturated_difference(losses[i].begin_ps, losses[i - 1].end_ps);
  };
  std::size_t narrowest = 1;
  for (std::size_t i = 2; i < losses.size(); ++i) {
    if (gap_before_ps(i) < gap_before_ps(narrowest)) narrowest = i;
  }
  losses[narrowest - 1] = joined(losses[narrowest - 1], losses[narrowest]);
  losses.erase(losses.begin() + static_cast<std::ptrdiff_t>(narrowest));
}

}  // namespace

void join_losses(std::vector<Loss>& losses, std::size_t max_count) {
  while (losses.size() > std::max<std::size_t>(max_count, 1)) join_narrowest_gap(losses);
}

LossCollector::LossCollector(std::size_t capacity) : capacity_(std::max<std::size_t>(capacity, 1)) {
  losses_.reserve(capacity_ + 1);
}

void LossCollector::take(const Tag& tag) {
  switch (tag.kind) {
    case TagKind::loss_begin:
      if (!open_since_ps_) open_since_ps_ = tag.time_ps;
      break;
    case TagKind::loss_end: {
      // A loss_end without its loss_begin still tells the count, but not the interval. In a stream
      // that is not sorted the end may also lie before the begin.
      const std::int64_t since_ps = open_since_ps_.value_or(tag.time_ps);
      add({std::min(since_ps, tag.time_ps), std::max(since_ps, tag.time_ps), tag.value});
      open_since_ps_.reset();
      break;
    }
    case TagKind::missed:
      add_missed(tag.time_ps, tag.value);
      break;
    case TagKind::photon:
    case TagKind::sync:
    case TagKind::marker:
    case TagKind::heartbeat:
      break;
    case TagKind::clock_break:
      // The end of the open loss may never come, and would be in another clock.
      if (open_since_ps_) add({*open_since_ps_, *open_since_ps_, -1});
      open_since_ps_.reset();
      break;
  }
}

void LossCollector::add_missed(std::int64_t time_ps, std::int64_t count) {
  if (!losses_.empty()) {
    Loss& last = losses_.back();
    const std::int64_t since_ps = saturated_difference(time_ps, last.begin_ps);
    const bool no_interval = last.begin_ps == last.end_ps && last.count >= 0 && count >= 0;
    if (no_interval && since_ps >= 0 && since_ps < missed_together_ps) {
      last.count = saturated_sum(last.count, count);
      lost_tags_ += static_cast<std::uint64_t>(count);
      return;
    }
  }
  add({time_ps, time_ps, count});
}

void LossCollector::add(const Loss& loss) {
  if (loss.count > 0) lost_tags_ += static_cast<std::uint64_t>(loss.count);
  insert_sorted(loss, losses_);
  join_losses(losses_, capacity_);
}

std::vector<Loss> LossCollector::losses(std::int64_t now_ps) const {
  std::vector<Loss> all = losses_;
  if (open_since_ps_) {
    insert_sorted({*open_since_ps_, std::max(now_ps, *open_since_ps_), -1}, all);
    join_losses(all, capacity_);
  }
  return all;
}

}  // namespace splid
