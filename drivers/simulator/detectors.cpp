#include "drivers/simulator/detectors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace splid::simulator {

void DetectorModel::describe(OptionVisitor& visitor) {
  visitor.number("dead_time_ns", dead_time_ns, {0, 1e6},
                 "time after each detection in which the detector is blind, ns");
  visitor.number("afterpulse_probability", afterpulse_probability, {0, 0.9},
                 "detections that are followed by one without light");
  visitor.number("afterpulse_ns", afterpulse_ns, {0, 1e6},
                 "mean time from the end of the dead time to that afterpulse, ns");
  visitor.integer("inputs", inputs, 1, 8,
                  "detectors that the light is split over, on inputs from photon_input on; each "
                  "has its own dead time");
}

Detectors::Detectors(const DetectorModel& model, std::uint64_t seed)
    : ideal_(model.inputs == 1 && model.dead_time_ns == 0 && model.afterpulse_probability == 0),
      dead_time_ps_(std::llround(model.dead_time_ns * 1e3)),
      afterpulse_probability_(model.afterpulse_probability),
      afterpulse_ps_(model.afterpulse_ns * 1e3),
      random_(seed, 4),
      blind_until_ps_(static_cast<std::size_t>(model.inputs),
                      std::numeric_limits<std::int64_t>::min()) {}

std::optional<int> Detectors::detect(std::int64_t time_ps) {
  if (ideal_) return 0;
  const auto count = static_cast<double>(blind_until_ps_.size());
  const int detector = count == 1 ? 0 : static_cast<int>(random_.uniform() * count);
  return fire(detector, time_ps);
}

std::optional<int> Detectors::take_release() {
  std::pop_heap(releases_.begin(), releases_.end(), is_later);
  const Release release = releases_.back();
  releases_.pop_back();
  return fire(release.detector, release.time_ps);
}

std::optional<int> Detectors::fire(int detector, std::int64_t time_ps) {
  std::int64_t& blind_until_ps = blind_until_ps_[static_cast<std::size_t>(detector)];
  if (time_ps < blind_until_ps) return std::nullopt;
  blind_until_ps = time_ps + dead_time_ps_;
  if (afterpulse_probability_ > 0 && random_.uniform() < afterpulse_probability_) {
    const double later_ps = afterpulse_ps_ * random_.exponential();
    releases_.push_back({blind_until_ps + std::llround(later_ps), detector});
    std::push_heap(releases_.begin(), releases_.end(), is_later);
  }
  return detector;
}

}  // namespace splid::simulator
