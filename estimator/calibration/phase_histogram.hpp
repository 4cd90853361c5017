#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/model/frame_view.hpp"
#include "estimator/sync/recording_period.hpp"

namespace splid::calibration {

// The phase of a frame's photons in the pattern period, by the frame's own syncs.
class FramePhase {
 public:
  // view: locked to its syncs.
  explicit FramePhase(const FrameView& view);
  // The phase in turns, in [0, 1); a tiny negative phase may round to 1.
  [[nodiscard]] double turn_of(std::int64_t photon_ps) const;
  // Which of so many bins of the period it is in.
  [[nodiscard]] std::size_t bin_of(std::int64_t photon_ps, std::size_t bins) const;

 private:
  std::int64_t origin_ps_;
  double phase_ps_;
  double turns_per_ps_;
  double curvature_;  // per ps
};

// The photons of a recording by their phase in the pattern period: the fold, in which a target at
// rest shows the pulses of any pattern. A bin is a 32nd of a pulse width, which widens a pulse by
// 0.004 %, but there are 2^23 at most (32 MiB). Frames that are not locked are passed over; losses
// are taken to fall on all phases alike.
class PhaseHistogram {
 public:
  // period_ps: nominal, > 0; width_ps: of a detected pulse, standard deviation, > 0.
  PhaseHistogram(double period_ps, double width_ps);

  void add(const FrameView& frame);

  [[nodiscard]] const std::vector<std::uint32_t>& counts() const { return counts_; }
  [[nodiscard]] std::size_t bins() const { return counts_.size(); }
  [[nodiscard]] double bin_ps() const { return period().period_ps / static_cast<double>(bins()); }
  [[nodiscard]] MeasuredPeriod period() const { return period_.period(); }
  [[nodiscard]] std::uint64_t photons() const { return photons_; }
  [[nodiscard]] double seconds() const { return seconds_; }  // seen, of locked frames
  // One standard deviation of the phase that all photons have in common, by the syncs' jitter; ps.
  [[nodiscard]] double std_phase_ps() const;

  // The bin of any whole number, as the circle closes.
  [[nodiscard]] std::size_t wrapped(std::ptrdiff_t bin) const;

 private:
  std::vector<std::uint32_t> counts_;
  RecordingPeriod period_;
  std::uint64_t photons_ = 0;
  double seconds_ = 0;
  double phase_variance_ps2_ = 0;  // times photons squared
};

}  // namespace splid::calibration
