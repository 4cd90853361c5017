#include "daemon/recording/stray_times.hpp"

#include <algorithm>

#include "protocol/ptu_encode.hpp"
#include "protocol/saturated.hpp"

namespace splid::recording {
namespace {

// Design note: a live source that is well has a tag or a heartbeat within some ms, so that no tag
// of it waits. A stray time that is less far ahead costs the recording less than 1 s of tags.
constexpr std::int64_t longest_step_ps = 1'000'000'000'000;

constexpr int backward_tags = 16;  // as the framer has it

}  // namespace

std::span<const Tag> StrayTimes::sort_out(std::span<const Tag> tags) {
  const std::size_t near = steady(tags);
  if (near == tags.size()) return tags;
  kept_.assign(tags.begin(), tags.begin() + static_cast<std::ptrdiff_t>(near));
  for (const Tag& tag : tags.subspan(near)) take(tag);
  return kept_;
}

// How many of the tags, from the first on, are within 1 s of the newest tag before them: all, where
// the stream is well. Design note: every tag that is recorded comes by here. Without a member in
// the loop it takes 2 ns instead of 4.5.
std::size_t StrayTimes::steady(std::span<const Tag> tags) {
  if (waiting_ || !newest_ps_ || tags.empty()) return 0;
  constexpr auto reach = static_cast<std::uint64_t>(longest_step_ps);
  std::int64_t newest_ps = *newest_ps_;
  std::size_t count = 0;
  for (; count < tags.size(); ++count) {
    const Tag& tag = tags[count];
    const std::uint64_t ahead =
        static_cast<std::uint64_t>(tag.time_ps) - static_cast<std::uint64_t>(newest_ps) + reach;
    if (ahead > 2 * reach || tag.kind == TagKind::clock_break) break;
    newest_ps = std::max(newest_ps, tag.time_ps);
  }
  if (count > 0) backward_run_ = 0;
  newest_ps_ = newest_ps;
  return count;
}

std::span<const Tag> StrayTimes::finish() {
  kept_.clear();
  if (waiting_) kept_.push_back(*waiting_);
  waiting_.reset();
  return kept_;
}

// Whether the tag goes into the recording as it comes.
bool StrayTimes::follows(const Tag& tag) {
  if (waiting_ || tag.kind == TagKind::clock_break) return false;
  const std::int64_t newest_ps = newest_ps_.value_or(tag.time_ps);
  const std::int64_t step_ps = saturated_difference(tag.time_ps, newest_ps);
  const bool may_be_stray = is_event(tag.kind) || tag.kind == TagKind::heartbeat;
  if (step_ps < -longest_step_ps || (may_be_stray && step_ps > longest_step_ps)) return false;
  newest_ps_ = std::max(newest_ps, tag.time_ps);
  backward_run_ = 0;
  return true;
}

void StrayTimes::take(const Tag& tag) {
  settle(tag);
  if (tag.kind == TagKind::clock_break) {
    newest_ps_.reset();
  } else if (!follows(tag)) {
    if (tag.time_ps > *newest_ps_) {
      waiting_ = tag;
      return;
    }
    if (++backward_run_ == backward_tags) {
      kept_.push_back({tag.time_ps, 0, TagKind::clock_break, {}});
      newest_ps_ = tag.time_ps;
      backward_run_ = 0;
    }
  }
  kept_.push_back(tag);
}

// Decides on the tag that waits. Before a clock_break it may be right, and harms no tag. The framer
// takes a loss without an interval to reach back to the tag before it, which makes this one 1 ps.
void StrayTimes::settle(const Tag& next) {
  if (!waiting_) return;
  const Tag tag = *waiting_;
  waiting_.reset();
  const bool is_stray = next.kind != TagKind::clock_break &&
                        saturated_difference(tag.time_ps, next.time_ps) > ptu_sorted_within_ps;
  if (!is_stray) {
    newest_ps_ = tag.time_ps;
    kept_.push_back(tag);
  } else if (is_event(tag.kind)) {
    ++strays_;
    kept_.push_back({*newest_ps_ + 1, 1, TagKind::missed, {}});
  }
}

}  // namespace splid::recording
