#include "daemon/view/track.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace splid::view {
namespace {

constexpr std::array<double, 6> windows_s{10, 30, 60, 300, 900, 3600};
constexpr std::size_t minute = 2;  // the index of 60 s

}  // namespace

Track::Track(const Clock& clock) : clock_(clock) {
  for (const double window_s : windows_s) histories_.emplace_back(window_s);
}

void Track::take(const FrameMessage& frame, std::string json, double ring_fill_ratio) {
  const auto waiting = std::exchange(waiting_, std::nullopt);
  if (waiting && waiting->timestamp_s != frame.timestamp_s) {
    add(*waiting, to_json(*waiting), ring_fill_ratio);
  }
  add(frame, std::move(json), ring_fill_ratio);
}

void Track::take_from_scene(FrameMessage frame, double ring_fill_ratio) {
  const auto waiting = std::exchange(waiting_, std::move(frame));
  if (waiting) add(*waiting, to_json(*waiting), ring_fill_ratio);
}

void Track::begin(const ScenePast& past, const std::string& pixel) {
  using Came = std::pair<FrameMessage, std::int64_t>;
  std::optional<Came> last;
  std::optional<Came> valid;
  past.tell(pixel, [&](const FrameMessage& frame, std::int64_t came_ns) {
    // How full the ring was is not known any more.
    constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
    for (History& history : histories_) history.add(frame, not_known);
    last = {frame, came_ns};
    if (frame.valid()) valid = last;
  });
  if (last) frame_.put(to_json(last->first), last->second);
  if (valid) valid_.put(to_json(valid->first), valid->second);
}

void Track::add(const FrameMessage& frame, std::string json, double ring_fill_ratio) {
  for (History& history : histories_) history.add(frame, ring_fill_ratio);
  const std::int64_t now_ns = clock_.steady_ns();
  if (frame.valid()) valid_.put(json, now_ns);
  frame_.put(std::move(json), now_ns);
}

std::size_t Track::window_of(std::int64_t seconds) {
  const auto* at =
      std::lower_bound(windows_s.begin(), windows_s.end(), static_cast<double>(seconds));
  return std::min<std::size_t>(static_cast<std::size_t>(at - windows_s.begin()),
                               windows_s.size() - 1);
}

const History& Track::last_minute() const { return histories_.at(minute); }

double Track::age_s(const LastMessage& last) const {
  return static_cast<double>(clock_.steady_ns() - last.came_ns) * 1e-9;
}

std::string Track::past_json() const {
  std::string json = fmt::format(R"({{"frame_age_s":{:.3f})", age_s(frame_));
  if (valid_.number > 0) {
    json += fmt::format(R"(,"valid_age_s":{:.3f},"valid":{})", age_s(valid_), valid_.json);
  }
  return json + "}";
}

}  // namespace splid::view
