#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace splid {

// What the photons say beyond the model that was fitted. A richer member of the same family
// explains them better, and the configuration can ask for that member: checks/finding.hpp has a row
// for each.
enum class FindingName {
  pulse_width,
  pulse_tail,
  unmodelled_light,
  acceleration,
  jerk,
  vibration,
  fading,
  pulse_amplitudes,
  wrong_pattern,
  dead_time,  // this and those below are of the detector: DetectorWaits
  afterpulsing,
  timing_walk,
};
inline constexpr std::size_t finding_names = 12;

// value, std: in the unit of its row.
struct Finding {
  FindingName name = FindingName::pulse_width;
  double value = 0;
  double std = 0;
  double gain_nats = 0;  // of the log-likelihood, over the fitted model
};

// A list with at most one finding of each name.
class FoundList {
 public:
  [[nodiscard]] std::span<const Finding> all() const { return std::span(found_).first(count_); }
  [[nodiscard]] bool has(FindingName name) const {
    return std::ranges::any_of(all(), [name](const Finding& each) { return each.name == name; });
  }
  // Leaves out a finding whose name is there.
  void add(const Finding& finding) {
    if (!has(finding.name)) found_.at(count_++) = finding;
  }

 private:
  std::array<Finding, finding_names> found_;
  std::size_t count_ = 0;
};

}  // namespace splid
