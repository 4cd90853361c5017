#pragma once

#include <cstdint>
#include <vector>

#include "drivers/simulator/fine_time.hpp"
#include "protocol/pattern.hpp"

namespace splid::simulator {

// How much light each pulse of a pattern period sends.
//
// Threads: any. No allocation after construction.
class EmissionSchedule {
 public:
  // pattern: valid
  explicit EmissionSchedule(const Pattern& pattern);

  // Sum of all amplitudes in one pattern period.
  [[nodiscard]] double amplitude() const { return amplitude_; }

  // The time of the pulse in which the amplitude accumulated since the period's start passes
  // `accumulated`, in [0, amplitude()); in ps since the period's start, in the generator's clock.
  [[nodiscard]] double pulse_time_ps(double accumulated) const;

 private:
  // Of the pattern, with its repeats.
  struct Segment {
    double begin_ps;
    double period_ps;
    double begin_amplitude;
    double amplitude;  // of one repeat
    double repeats;
    std::vector<double> times_ps;
    std::vector<double> accumulated;  // amplitudes up to and including each pulse
  };

  std::vector<Segment> segments_;
  double amplitude_ = 0;
};

// A ramp of the drift ends here, so that the clock of an endless run goes forwards.
inline constexpr double max_drift_ppm = 1000;

struct DriftRate {
  double ppm = 0;             // at and before the stream's start
  double ramp_ppm_per_s = 0;  // after the stream's start
};

// The generator's clock as the tagger sees it, one pattern period after the other. Within a period
// the clock's rate is constant.
//
// Threads: one. No allocation.
class GeneratorClock {
 public:
  // The first period starts at 0, the stream's start.
  GeneratorClock(const Pattern& pattern, DriftRate drift);

  [[nodiscard]] const FineTime& period_start() const { return start_; }
  [[nodiscard]] double period_ps() const { return period_ps_ * rate_; }  // tagger's clock
  // generator_ps: since the period's start, in the generator's clock.
  [[nodiscard]] FineTime at(double generator_ps) const {
    return start_.after(generator_ps * rate_);
  }

  void next_period();
  // Goes back by `count` periods, at least 1. May be called before the first next_period() only.
  void back_periods(std::int64_t count);

 private:
  void set_rate();

  double period_ps_;  // generator's clock
  // The rate of the tagger's clock to the generator's where there is no drift. It is not 1 where
  // the pattern is calibrated.
  double calibration_;
  DriftRate drift_;
  FineTime start_;
  double rate_ = 1;
};

}  // namespace splid::simulator
