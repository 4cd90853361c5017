#pragma once

#include <cstddef>
#include <cstdint>

namespace splid {

// How the pattern period of a frame is measured in the tagger's clock ([P] Eq. 19). Drift is the
// relative difference of that period from the calibrated one, in ppm. JSON: `drift`/`method`.
enum class DriftMethod {
  regression,  // the slope of the least-squares line through all syncs of the frame
  endpoints,   // the time from the first sync to the last over the periods between, as [P] has it
  off,         // the calibrated period; the syncs give the phase alone
};

// The pattern's clock in one frame, as the tagger sees it. Period k of the pattern starts at
//   origin_ps + phase_ps + k * period_ps
// and, where the clock's rate changes within the frame, curvature_ps * (x^2 - curvature_zero) later
// than that, with x from -1 at the frame's begin to 1 at its end.
struct SyncFit {
  // False: less than 3 syncs, or no line that most of them agree on. Only `count` holds then.
  bool locked = false;
  std::int64_t origin_ps = 0;  // tagger's clock, near mid-frame, so that phase_ps stays small
  double phase_ps = 0;         // of a pattern start near origin_ps, |phase_ps| <= period_ps
  double period_ps = 0;        // in the tagger's clock: [P] Eq. 19
  double std_phase_ps = 0;     // one standard deviation of phase_ps, at origin_ps
  double std_period_ps = 0;    // one standard deviation of period_ps
  double curvature_ps = 0;     // 0 up to 4 of its deviations; 1 ppm/s makes 312 ps in 50 ms
  double curvature_zero = 0;   // mean of x^2 over the syncs: 1/3 where they are all over the frame
  double drift_ppm = 0;        // (period_ps / calibrated period - 1) * 1e6
  double jitter_ps = 0;        // rms distance of the accepted syncs from the line
  std::size_t count = 0;       // sync tags given
  std::size_t missing = 0;   // periods that start in the frame and have no accepted sync; those so
                             // near its ends that jitter may put the sync outside do not count
  std::size_t spurious = 0;  // sync tags that were not accepted: outliers and doubles
};

}  // namespace splid
