#include "drivers/simulator/detectors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace splid::simulator {

void DetectorModel::describe(OptionVisitor& visitor) {
  visitor.number("dead_time_ns", dead_time_ns, {0, 1e6}, "dead time after each detection, ns");
  visitor.number("afterpulse_probability", afterpulse_probability, {0, 0.9},
                 "probability of an afterpulse after a detection");
  visitor.number("afterpulse_ns", afterpulse_ns, {0, 1e6},
                 "mean time from the end of the dead time to the afterpulse, ns");
  visitor.pairs("walk", walk, {Bounds{0, 1e6}, Bounds{0, 1e4}},
                "timing walk, rows of [wait, delay]: wait since the last detection, ns, and delay "
                "of the detection after it, ps; linear in between, 0 above the last");
  visitor.integer("inputs", inputs, 1, 8,
                  "number of detectors that share the light, on inputs from photon_input on; each "
                  "has its own dead time");
}

std::optional<OptionFault> DetectorModel::validate() const {
  for (std::size_t i = 1; i < walk.size(); ++i) {
    if (walk[i][0] > walk[i - 1][0]) continue;
    return OptionFault{
        "/walk/" + std::to_string(i) + "/0",
        "is " + std::to_string(walk[i][0]) + " ns; must be longer than the wait before"};
  }
  return std::nullopt;
}

Detectors::Detectors(const DetectorModel& model, std::uint64_t seed)
    : ideal_(model.inputs == 1 && model.dead_time_ns == 0 && model.afterpulse_probability == 0 &&
             model.walk.empty()),
      dead_time_ps_(std::llround(model.dead_time_ns * 1e3)),
      afterpulse_probability_(model.afterpulse_probability),
      afterpulse_ps_(model.afterpulse_ns * 1e3),
      walk_(model.walk),
      random_(seed, 4),
      dead_until_ps_(static_cast<std::size_t>(model.inputs),
                     std::numeric_limits<std::int64_t>::min() / 2) {}

std::optional<Detection> Detectors::detect(std::int64_t time_ps) {
  if (ideal_) return Detection{};
  const auto count = static_cast<double>(dead_until_ps_.size());
  const int detector = count == 1 ? 0 : static_cast<int>(random_.uniform() * count);
  return fire(detector, time_ps);
}

std::optional<Detection> Detectors::take_release() {
  std::pop_heap(releases_.begin(), releases_.end(), is_later);
  const Release release = releases_.back();
  releases_.pop_back();
  return fire(release.detector, release.time_ps);
}

std::optional<Detection> Detectors::fire(int detector, std::int64_t time_ps) {
  std::int64_t& dead_until_ps = dead_until_ps_[static_cast<std::size_t>(detector)];
  if (time_ps < dead_until_ps) return std::nullopt;
  const std::int64_t wait_ps = time_ps - (dead_until_ps - dead_time_ps_);
  dead_until_ps = time_ps + dead_time_ps_;
  if (afterpulse_probability_ > 0 && random_.uniform() < afterpulse_probability_) {
    const double later_ps = afterpulse_ps_ * random_.exponential();
    releases_.push_back({dead_until_ps + std::llround(later_ps), detector});
    std::push_heap(releases_.begin(), releases_.end(), is_later);
  }
  return Detection{detector, late_ps(wait_ps)};
}

std::int64_t Detectors::late_ps(std::int64_t wait_ps) const {
  const double wait_ns = static_cast<double>(wait_ps) * 1e-3;
  if (walk_.empty() || wait_ns > walk_.back()[0]) return 0;
  if (wait_ns <= walk_.front()[0]) return std::llround(walk_.front()[1]);
  std::size_t above = 1;
  while (walk_[above][0] < wait_ns) ++above;
  const NumberPair& low = walk_[above - 1];
  const NumberPair& high = walk_[above];
  return std::llround(std::lerp(low[1], high[1], (wait_ns - low[0]) / (high[0] - low[0])));
}

}  // namespace splid::simulator
