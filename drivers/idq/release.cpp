#include "drivers/idq/release.hpp"

#include <limits>
#include <utility>

namespace splid::idq {
namespace {

constexpr std::int64_t ps_a_ns = 1000;

// Half of what a tag's 64 bits hold.
constexpr std::int64_t longest_clock_ps = std::numeric_limits<std::int64_t>::max() / 2;

std::int64_t ps_between(Release::Time from, Release::Time to) {
  return std::chrono::nanoseconds(to - from).count() * ps_a_ns;
}

}  // namespace

Release::Release(const Options& options, TagSink& sink) : options_(options), out_(sink) {}

// Design note: a part is due a slack after it came, so that a part that comes later than its
// predecessor by less than that leaves no gap. The instrument's clock and this machine's drift
// apart by some 50 ppm, 0.2 s an hour: where the next part comes after it was due, or earlier than
// two slacks before, its time is set anew.
void Release::add(SubAcquisition part, Time now) {
  if (part.index - first_index_ > longest_clock_ps / options_.period_ps()) begin_clock(part.index);
  const std::int64_t begin_ps = begin_of(part);
  const std::int64_t early_ps = has_anchor_ ? begin_ps - anchor_ps_ - ps_between(anchor_, now) : 0;
  const std::int64_t slack_ps = ps_between(Time{}, Time{} + slack);
  if (!has_anchor_ || early_ps < 0 || early_ps > 2 * slack_ps) {
    has_anchor_ = true;
    anchor_ = now + slack;
    anchor_ps_ = begin_ps;
  }
  parts_.push_back(std::move(part));
}

void Release::begin_clock(std::int64_t index) {
  flush();
  out_.put({reached_ps_, 0, TagKind::clock_break, {}});
  first_index_ = index;
  has_anchor_ = false;
}

std::int64_t Release::begin_of(const SubAcquisition& part) const {
  return (part.index - first_index_) * options_.period_ps();
}

void Release::run(Time now) {
  if (has_anchor_) advance(anchor_ps_ + ps_between(anchor_, now));
}

void Release::flush() { advance(std::numeric_limits<std::int64_t>::max()); }

void Release::advance(std::int64_t until_ps) {
  while (!parts_.empty()) {
    const std::int64_t begin_ps = begin_of(parts_.front());
    if (until_ps <= begin_ps) break;
    if (!std::exchange(is_under_way_, true)) {
      next_.assign(options_.inputs.size(), 0);
      if (parts_.front().lacks) out_.put({begin_ps, 0, TagKind::loss_begin, {}});
    }
    if (!merge(begin_ps, until_ps)) return;  // a stop was requested
    if (until_ps - begin_ps < options_.period_ps()) {
      reached_ps_ = until_ps;
      out_.put(heartbeat_tag(until_ps));
      break;
    }
    end_part(begin_ps);
  }
  out_.publish();
}

// Writes the tags of the first part that are before until_ps. False once a stop was requested.
bool Release::merge(std::int64_t begin_ps, std::int64_t until_ps) {
  const std::vector<Times>& of_input = parts_.front().of_input;
  const auto end = static_cast<std::uint64_t>(until_ps - begin_ps);
  while (true) {
    std::uint64_t least_ps = end;
    std::size_t from = of_input.size();
    for (std::size_t i = 0; i < of_input.size(); ++i) {
      if (next_[i] == of_input[i].size() || of_input[i][next_[i]] >= least_ps) continue;
      least_ps = of_input[i][next_[i]];
      from = i;
    }
    if (from == of_input.size()) return true;
    ++next_[from];
    const auto input = static_cast<int>(options_.inputs[from].input);
    if (!out_.put(photon_tag(begin_ps + static_cast<std::int64_t>(least_ps), input))) return false;
  }
}

void Release::end_part(std::int64_t begin_ps) {
  reached_ps_ = begin_ps + options_.period_ps();
  if (!parts_.front().lacks) {
    out_.put({begin_ps + options_.width_ps(), 0, TagKind::loss_begin, {}});
  }
  out_.put({reached_ps_, -1, TagKind::loss_end, {}});
  out_.put(heartbeat_tag(reached_ps_));
  parts_.pop_front();
  is_under_way_ = false;
}

}  // namespace splid::idq
