#include "daemon/stream/silence.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace splid {
namespace {

using Times = std::span<const std::int64_t>;

constexpr std::size_t least_gaps = 8;
constexpr std::size_t least_gaps_of_tail = 64;
constexpr double one_period = 1.5;
constexpr double odds_nats = 20.7;                // 1e-9 a frame
constexpr std::int64_t least_run_ps = 2'000'000;  // tags may be out of order by half of that

double log_odds(std::size_t gaps) { return odds_nats + std::log(static_cast<double>(gaps)); }

// Statistics of the gaps between syncs.
struct Gaps {
  std::size_t count = 0;
  std::size_t of_one_period = 0;

  Gaps(Times syncs, double period_ps) {
    if (syncs.empty()) return;
    count = syncs.size() - 1;
    for (std::size_t i = 0; i < count; ++i) {
      const auto gap_ps = static_cast<double>(syncs[i + 1] - syncs[i]);
      of_one_period += gap_ps < one_period * period_ps ? 1 : 0;
    }
  }
  [[nodiscard]] bool is_regular() const { return 2 * of_one_period > count; }

  // The longest gap that syncs dropped one by one can explain. After a share q of the syncs the
  // next is missing, so that one of `count` gaps is n periods long with a chance of
  // count q^(n - 1). In 50 ms of [P]'s syncs that is 5 periods where a thousandth is missing, and
  // 45 where half is.
  [[nodiscard]] double longest_by_chance_periods() const {
    const auto longer = static_cast<double>(std::max<std::size_t>(count - of_one_period, 1));
    return 1 + log_odds(count) / std::log(static_cast<double>(count) / longer);
  }
};

std::int64_t run_ps(double length_ps) {
  return std::max<std::int64_t>(std::llround(length_ps), least_run_ps);
}

// Design note: flickering light makes longer gaps than chance at an even rate would (in a recording
// of a quTAG 250 us, 90 times the mean). So the long gaps themselves tell what is usual: the mean
// by which the longest tenth of the gaps exceeds all others. The longest eighth of that tenth is
// left out, since a silence may be among them, and the mean is doubled.
double run_by_tail_ps(Times syncs) {
  std::array<double, 1024> sample;
  const std::size_t gaps = syncs.size() - 1;
  const std::size_t stride = (gaps + sample.size() - 1) / sample.size();
  std::size_t count = 0;
  for (std::size_t i = 0; i < gaps; i += stride) {
    sample[count++] = static_cast<double>(syncs[i + 1] - syncs[i]);
  }
  std::sort(sample.begin(), sample.begin() + count);
  const std::size_t tail = count - count / 10;
  const std::size_t end = count - (count - tail) / 8;
  double excess_ps = 0;
  for (std::size_t i = tail; i < end; ++i) excess_ps += sample[i] - sample[tail - 1];
  excess_ps /= static_cast<double>(end - tail);
  return sample[tail - 1] + 2 * excess_ps * log_odds(gaps);
}

std::size_t count_between(Times times, std::int64_t begin_ps, std::int64_t end_ps) {
  const auto begin = std::lower_bound(times.begin(), times.end(), begin_ps);
  return static_cast<std::size_t>(std::lower_bound(begin, times.end(), end_ps) - begin);
}

bool is_lost(const Frame& frame, std::int64_t time_ps) {
  return std::any_of(frame.losses.begin(), frame.losses.end(), [&](const Loss& loss) {
    return loss.begin_ps <= time_ps && time_ps < loss.end_ps;
  });
}

// Goes through the runs of one frame in which no tag came.
class Search {
 public:
  Search(Frame& frame, bool is_regular, std::int64_t run_ps, double nats)
      : frame_(frame), is_regular_(is_regular), run_ps_(run_ps), nats_(nats) {}

  std::size_t all() {
    std::int64_t before_ps = frame_.start_ps;
    for (const std::int64_t sync_ps : frame_.syncs_ps.view()) {
      if (sync_ps - before_ps > run_ps_) without_syncs(before_ps, sync_ps);
      before_ps = sync_ps;
    }
    if (frame_.end_ps - before_ps > run_ps_) without_syncs(before_ps, frame_.end_ps);
    if (found_ > 0) frame_.settle_losses();
    return found_;
  }

 private:
  // Takes a run without syncs; the photons in it cut it into runs without photons.
  void without_syncs(std::int64_t begin_ps, std::int64_t end_ps) {
    sync_before_ps_ = begin_ps;
    sync_after_ps_ = end_ps;
    const Times photons = frame_.densest_photons();
    std::int64_t before_ps = begin_ps;
    for (auto photon = std::lower_bound(photons.begin(), photons.end(), begin_ps);
         photon != photons.end() && *photon < end_ps; ++photon) {
      if (*photon - before_ps > run_ps_) without_photons(before_ps, *photon);
      before_ps = std::max(before_ps, *photon);
    }
    if (end_ps - before_ps > run_ps_) without_photons(before_ps, end_ps);
  }

  // Takes a run without syncs and photons; the markers in it cut it into runs without any tag.
  void without_photons(std::int64_t begin_ps, std::int64_t end_ps) {
    for (const MarkerTag& marker : frame_.markers.view()) {
      if (marker.time_ps <= begin_ps || marker.time_ps >= end_ps) continue;
      if (marker.time_ps - begin_ps > run_ps_) judge(begin_ps, marker.time_ps);
      begin_ps = marker.time_ps;
    }
    if (end_ps - begin_ps > run_ps_) judge(begin_ps, end_ps);
  }

  void judge(std::int64_t begin_ps, std::int64_t end_ps) {
    const bool is_silence =
        is_regular_ ? begin_ps - sync_before_ps_ <= run_ps_ && sync_after_ps_ - end_ps <= run_ps_
                    : is_surprising(begin_ps, end_ps);
    if (!is_silence || is_lost(frame_, begin_ps + (end_ps - begin_ps) / 2)) return;
    frame_.add_loss(begin_ps + 1, end_ps, -1);
    ++found_;
  }

  // Whether the run is surprising beside the tags on its longer side and, if the other side is at
  // least a quarter as long as the run, beside the tags on that side too.
  [[nodiscard]] bool is_surprising(std::int64_t begin_ps, std::int64_t end_ps) const {
    const std::int64_t length_ps = end_ps - begin_ps;
    const std::int64_t left_ps = std::min(length_ps, begin_ps - frame_.start_ps);
    const std::int64_t right_ps = std::min(length_ps, frame_.end_ps - end_ps);
    const bool left = is_surprising(begin_ps - left_ps, left_ps, length_ps);
    const bool right = is_surprising(end_ps, right_ps, length_ps);
    const std::int64_t enough_ps = length_ps / 4;
    return left_ps >= right_ps ? left && (right || right_ps < enough_ps)
                               : right && (left || left_ps < enough_ps);
  }

  // Whether chance would not put so many tags into side_ps and none into length_ps. A sync and its
  // photon count as one tag.
  [[nodiscard]] bool is_surprising(std::int64_t begin_ps, std::int64_t side_ps,
                                   std::int64_t length_ps) const {
    if (side_ps <= 0) return false;
    const std::int64_t end_ps = begin_ps + side_ps;
    const std::size_t tags = std::max(count_between(frame_.syncs_ps.view(), begin_ps, end_ps),
                                      count_between(frame_.densest_photons(), begin_ps, end_ps));
    const double ratio = static_cast<double>(length_ps) / static_cast<double>(side_ps);
    return static_cast<double>(tags) * std::log1p(ratio) > nats_;
  }

  Frame& frame_;
  bool is_regular_;
  std::int64_t run_ps_;  // a shorter run is no silence
  double nats_;
  std::int64_t sync_before_ps_ = 0;  // the syncs around the run, or the frame's ends
  std::int64_t sync_after_ps_ = 0;
  std::size_t found_ = 0;
};

}  // namespace

std::size_t Silence::mark(Frame& frame, double period_ps) {
  const std::span<const std::int64_t> syncs = frame.syncs_ps.view();
  const Gaps gaps(syncs, period_ps);
  const bool is_regular = gaps.count >= least_gaps ? gaps.is_regular() : regular_run_ps_ > 0;
  if (!is_regular) regular_run_ps_ = 0;
  if (is_regular && gaps.count >= least_gaps) {
    regular_run_ps_ = run_ps(gaps.longest_by_chance_periods() * period_ps);
  }
  if (is_regular) return Search(frame, true, regular_run_ps_, 0).all();
  if (gaps.count < least_gaps_of_tail) return 0;
  const std::size_t tags = std::max(syncs.size(), frame.densest_photons().size());
  return Search(frame, false, run_ps(run_by_tail_ps(syncs)), log_odds(tags)).all();
}

}  // namespace splid
