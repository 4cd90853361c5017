#include "estimator/model/configured_pulse.hpp"

#include "estimator/model/units.hpp"
#include "protocol/error.hpp"

namespace splid {

std::unique_ptr<PulseShape> configured_pulse(const Pattern& pattern, const PulseOptions& options) {
  if (options.shape == Shape::gaussian) return make_gaussian(options.sigma_ps * ns_per_ps);
  if (!pattern.pulse) {
    throw Error(Fault::usage,
                "pulse.shape is tabulated, but the pattern file has no pulse block; calibrate the "
                "pattern or use pulse.shape gaussian");
  }
  return make_tabulated(*pattern.pulse);
}

}  // namespace splid
