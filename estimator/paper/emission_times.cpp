#include "estimator/paper/emission_times.hpp"

namespace splid::paper {

EmissionTimes::EmissionTimes(const Pattern& pattern) : train_(pattern) {
  for (const PulseTrain::Segment& segment : train_.segments) {
    const Comb& comb = segment.comb;
    const double repeats = std::round((segment.end_ns - segment.begin_ns) / comb.period_ns);
    for (double n = 0; n < repeats; ++n) {
      for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
        times_ns_.push_back(segment.begin_ns + (n * comb.period_ns + comb.times_ns[p]));
        amplitudes_.push_back(comb.amplitudes[p]);
      }
    }
  }
}

}  // namespace splid::paper
