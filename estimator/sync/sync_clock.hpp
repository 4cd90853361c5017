#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splid {

// How the pattern period is measured in the tagger's clock.
enum class DriftMethod {
  regression,  // least-squares line through all syncs of a frame
  endpoints,   // first and last sync, [P] Eq. 19 and 20
  off,         // the calibrated period; the syncs give the phase alone
};

// The pattern's clock as seen by the tagger in one frame: period k starts at origin_ps + phase_ps +
// k * period_ps, and where the clock's rate changes bend_ps (x^2 - bend_zero) later, x from -1 to 1
// over the frame.
struct SyncFit {
  bool locked = false;         // false: too few syncs (< 3) or none that agree; only counts hold
  std::int64_t origin_ps = 0;  // tagger's clock, near mid-frame, so that phase_ps stays small
  double phase_ps = 0;         // of a pattern start near origin_ps, |phase_ps| <= period_ps
  double period_ps = 0;        // in the tagger's clock
  double std_phase_ps = 0;     // one standard deviation of phase_ps, at origin
  double std_period_ps = 0;
  double bend_ps = 0;        // 0 unless 4 of its standard deviations; 1 ppm/s in 50 ms is 312 ps
  double bend_zero = 0;      // mean of x^2: 1/3 with syncs all over the frame
  double drift_ppm = 0;      // (period_ps / calibrated - 1) * 1e6
  double jitter_ps = 0;      // rms of the accepted syncs about the line
  std::size_t count = 0;     // sync tags given
  std::size_t missing = 0;   // periods that start in the frame and have no accepted sync; not
                             // those so near its ends that jitter may put the sync outside
  std::size_t spurious = 0;  // count less those accepted: outliers and doubles
};

// Fits the pattern's clock to the syncs of one frame after the other. Syncs are counted by time,
// not by number, so missing, doubled and stray ones and instruments that send only the syncs beside
// photons come out right.
//
// Threads: one. No allocation after construction for frames of up to max_syncs; more are thinned
// evenly. Remembers the last period that it locked to, and nothing else.
class SyncClock {
 public:
  // calibrated_period_ps > 0. max_drift_ppm: how far the measured period may be from it.
  SyncClock(double calibrated_period_ps, DriftMethod method, std::size_t max_syncs,
            double max_drift_ppm = 500);

  // syncs_ps: nearly sorted, in [begin_ps, end_ps). Source: [P] Eq. 19, 20.
  SyncFit fit(std::span<const std::int64_t> syncs_ps, std::int64_t begin_ps, std::int64_t end_ps);

  // Best period known: of the last locked fit, or the calibrated one.
  [[nodiscard]] double period_ps() const { return period_ps_; }
  void reset() { period_ps_ = calibrated_period_ps_; }

 private:
  double calibrated_period_ps_;
  DriftMethod method_;
  double max_drift_ppm_;
  double period_ps_;
  std::vector<double> position_;  // scratch: syncs relative to the origin
  std::vector<double> residual_;  // scratch
};

}  // namespace splid
