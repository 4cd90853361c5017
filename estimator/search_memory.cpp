#include "estimator/search_memory.hpp"

#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/model/units.hpp"
#include "estimator/search/target_search.hpp"

namespace splid {

std::size_t search_table_bytes(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms) {
  const bool moving = scene.motion != Motion::static_target;
  const double max_travel_ns =
      moving ? travel_ns_at(scene.max_speed_mps, frame_length_ms * 1e6) : 0;
  return TargetSearch::table_bytes(PulseTrain(pattern), *configured_pulse(pattern, pulse),
                                   max_travel_ns, options.effort);
}

}  // namespace splid
