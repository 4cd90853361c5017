#include "daemon/stream/scan_cutter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::int64_t reordered_ps = 1'000'000;
constexpr std::size_t tags_in_order = 16'384;  // put in order at a time
// So that no arithmetic with the times in a line overflows: a month.
constexpr std::int64_t longest_line_ps = 2'600'000'000'000'000'000;
constexpr double no_tick = std::numeric_limits<double>::quiet_NaN();

bool has(const Tag& tag, int bits) {
  return tag.kind == TagKind::marker && bits != 0 && (tag.value & bits) == bits;
}

bool is_in_order(const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }

}  // namespace

std::int64_t dwell_start_ps(const ScanLines& scan, std::int64_t start_ps, std::int64_t stop_ps,
                            std::int64_t k) {
  const std::int64_t length_ps = stop_ps - start_ps;
  if (k == 0 || k == scan.pixels) return k == 0 ? start_ps : stop_ps;
  if (scan.sine_percent > 0) {
    const double swing = std::numbers::pi / 2 * scan.sine_percent / 100;
    const double place = 2 * static_cast<double>(k) / static_cast<double>(scan.pixels) - 1;
    const double part = (std::asin(place * std::sin(swing)) / swing + 1) / 2;
    return start_ps + std::llround(part * static_cast<double>(length_ps));
  }
  // Rounded down: a photon at a dwell's begin whose time was rounded, as in T3, is in the dwell. In
  // two steps, so that nothing overflows.
  const std::int64_t whole = length_ps / scan.pixels, rest = length_ps % scan.pixels;
  return start_ps + k * whole + k * rest / scan.pixels;
}

ScanCutter::ScanCutter(const ScanLines& scan, const ChannelMap& channels, std::size_t room,
                       Framer& framer)
    : scan_(scan), channels_(channels), framer_(framer), recent_(tags_in_order), line_(room) {}

void ScanCutter::push(std::span<const Tag> tags, std::int64_t arrival_ns) {
  arrival_ns_ = arrival_ns;
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::clock_break) {
      settle_all();
      give_up_line();
      framer_.outside(tag);
      continue;
    }
    if (recent_.size() == tags_in_order) {
      settle_old();
      if (recent_.size() > tags_in_order / 2) settle_all();  // so many in 1 us
    }
    recent_.push(framer_.undelayed(tag));
  }
  settle_old();
}

void ScanCutter::finish() {
  settle_all();
  if (!line_start_ps_) return;
  framer_.count_open_line();
  put_line_outside();
}

void ScanCutter::settle_all() {
  put_in_order();
  settle(recent_.size());
}

// Takes those of the recent tags that are so old that none comes before them.
void ScanCutter::settle_old() {
  if (recent_.empty()) return;
  const std::int64_t newest_ps = recent_.back().time_ps;
  put_in_order();
  const auto end = std::find_if(recent_.begin(), recent_.end(), [newest_ps](const Tag& tag) {
    return saturated_difference(newest_ps, tag.time_ps) < reordered_ps;
  });
  settle(static_cast<std::size_t>(end - recent_.begin()));
}

void ScanCutter::put_in_order() {
  const auto before = [this](const Tag& a, const Tag& b) {
    return a.time_ps != b.time_ps ? a.time_ps < b.time_ps : rank(a) < rank(b);
  };
  if (std::is_sorted(recent_.begin(), recent_.end(), before)) return;
  std::sort(recent_.begin(), recent_.end(), before);
}

void ScanCutter::settle(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) take(recent_[i]);
  std::copy(recent_.begin() + count, recent_.end(), recent_.begin());
  recent_.resize(recent_.size() - count);
}

// Which of two tags of one time is first.
int ScanCutter::rank(const Tag& tag) const {
  if (has(tag, scan_.stop)) return 0;
  if (has(tag, scan_.picture)) return 1;
  return has(tag, scan_.start) ? 2 : 3 + static_cast<int>(tag.kind);
}

void ScanCutter::take(const Tag& tag) {
  if (tag.kind == TagKind::marker) take_marker(tag);
  if (tag.kind == TagKind::heartbeat) return;
  if (!line_start_ps_) {
    put_outside({&tag, 1});
  } else if (!line_.push(tag)) {
    give_up_line();
    put_outside({&tag, 1});
  }
}

void ScanCutter::take_marker(const Tag& tag) {
  if (line_start_ps_ && has(tag, scan_.stop) && tag.time_ps > *line_start_ps_) {
    end_line(tag.time_ps);
  }
  if (has(tag, scan_.picture) && next_line_ > 0) {
    if (picture_ == 0 && next_line_ < scan_.lines) framer_.tell_half_picture(next_line_);
    ++picture_;
    next_line_ = 0;
  }
  if (has(tag, scan_.start)) begin_line(tag.time_ps);
}

void ScanCutter::begin_line(std::int64_t start_ps) {
  give_up_line();
  if (scan_.picture == 0 && scan_.lines > 0 && next_line_ == scan_.lines) {
    ++picture_;
    next_line_ = 0;
  }
  framer_.count_line();
  place_ = {picture_, next_line_++, 0, scan_.pixels, no_tick};
  line_start_ps_ = start_ps;
}

void ScanCutter::end_line(std::int64_t stop_ps) {
  const std::int64_t start_ps = *line_start_ps_;
  if (saturated_difference(stop_ps, start_ps) < scan_.pixels ||
      saturated_difference(stop_ps, start_ps) > longest_line_ps) {
    return give_up_line();
  }
  line_start_ps_.reset();
  if (!std::is_sorted(line_.begin(), line_.end(), is_in_order)) {
    std::sort(line_.begin(), line_.end(), is_in_order);  // some came later than 1 us
  }
  const auto at = [this](std::int64_t time_ps) {
    return std::lower_bound(line_.begin(), line_.end(), Tag{time_ps, 0, {}, {}}, is_in_order) -
           line_.begin();
  };
  const std::span<const Tag> all = line_.view();
  const std::size_t first = at(start_ps), last = at(stop_ps);
  put_outside(all.first(first));
  make_dwells(all.subspan(first, last - first), start_ps, stop_ps);
  put_outside(all.subspan(last));
  line_.clear();
}

void ScanCutter::make_dwells(std::span<const Tag> tags, std::int64_t start_ps,
                             std::int64_t stop_ps) {
  const bool runs_back = scan_.both_ways && place_.line % 2 == 1;
  std::size_t told = 0;  // of whose ticks tick_at() knows
  const auto tell_until = [&](std::int64_t time_ps) {
    while (told < tags.size() && tags[told].time_ps <= time_ps) count_tick(tags[told++]);
  };
  std::size_t first = 0;
  for (std::int64_t k = 0; k < scan_.pixels; ++k) {
    const std::int64_t begin_ps = dwell_start_ps(scan_, start_ps, stop_ps, k);
    const std::int64_t end_ps = dwell_start_ps(scan_, start_ps, stop_ps, k + 1);
    std::size_t last = first;
    while (last < tags.size() && tags[last].time_ps < end_ps) ++last;
    const std::int64_t mid_ps = begin_ps + (end_ps - begin_ps) / 2;
    tell_until(mid_ps);
    place_.column = runs_back ? scan_.pixels - 1 - k : k;
    place_.tick = tick_at(mid_ps);
    framer_.push_dwell(place_, begin_ps, end_ps, tags.subspan(first, last - first), arrival_ns_);
    first = last;
  }
  tell_until(stop_ps);
}

void ScanCutter::give_up_line() {
  if (!line_start_ps_) return;
  framer_.count_cut_line();
  put_line_outside();
}

void ScanCutter::put_line_outside() {
  line_start_ps_.reset();
  put_outside(line_.view());
  line_.clear();
}

void ScanCutter::put_outside(std::span<const Tag> tags) {
  for (const Tag& tag : tags) {
    count_tick(tag);
    framer_.outside(tag);
  }
}

void ScanCutter::count_tick(const Tag& tag) {
  if ((channels_.roles(tag) & role_marker) == 0) return;
  ++ticks_;
  tick_before_ps_ = tick_ps_;
  tick_ps_ = tag.time_ps;
}

// The clock is regular, so that its last two ticks tell where it is between two.
double ScanCutter::tick_at(std::int64_t time_ps) const {
  const double step_ps = static_cast<double>(saturated_difference(tick_ps_, tick_before_ps_));
  if (ticks_ < 2 || !(step_ps > 0)) return no_tick;
  const auto since_ps = static_cast<double>(saturated_difference(time_ps, tick_ps_));
  return static_cast<double>(ticks_ - 1) + since_ps / step_ps;
}

}  // namespace splid
