#include "estimator/search_memory.hpp"

#include <sstream>

#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/search/frame_search.hpp"

namespace splid {

std::size_t search_table_bytes(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms) {
  return TargetSearch::table_bytes(PulseTrain(pattern), *configured_pulse(pattern, pulse),
                                   FrameSearch::max_walk_ns(scene, frame_length_ms * 1e6),
                                   options.effort);
}

std::optional<OptionFault> too_large_a_search(const Pattern& pattern, const PulseOptions& pulse,
                                              const SceneOptions& scene,
                                              const EstimatorOptions& options,
                                              double frame_length_ms) {
  // So much takes a second or two to make, and a photon's place is reserved for each pulse near it.
  constexpr std::size_t bytes_a_mib = 1 << 20, most_mib = 1 << 10, most_pulses_near = 256;
  const PulseTrain train(pattern);
  const auto shape = configured_pulse(pattern, pulse);
  // The least that a zoom looks at, to either side.
  const double about_ns = (2 * TargetSearch::least_reach_widths + 4) * shape->width_ns();
  const std::size_t near = widest_overlap(comb_windows(train, -about_ns, about_ns));
  std::ostringstream text;
  if (near > most_pulses_near) {
    text << "a photon may be near " << near << " pulses, " << most_pulses_near << " at most: "
         << "the closest pulses are " << train.closest_ns << " ns apart, and a pulse is "
         << shape->width_ns() << " ns wide; space the pulses, or take a narrower /pulse";
    return OptionFault{"", text.str()};
  }
  const std::size_t bytes = search_table_bytes(pattern, pulse, scene, options, frame_length_ms);
  if (bytes <= most_mib * bytes_a_mib) return std::nullopt;
  text << "the tables of the search would take " << bytes / bytes_a_mib << " MiB, " << most_mib
       << " at most: its pulses are " << train.closest_ns << " ns apart or more, in "
       << train.circle_ns << " ns; space the pulses, shorten the "
       << "period, or lower /scene/max_speed_mps, /frame/length_ms or /estimator/effort";
  return OptionFault{"", text.str()};
}

}  // namespace splid
