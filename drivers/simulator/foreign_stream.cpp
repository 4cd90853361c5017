#include "drivers/simulator/foreign_stream.hpp"

#include <cmath>

namespace splid::simulator {
namespace {

constexpr std::uint64_t foreign_stream = 5;

}  // namespace

void ForeignOptions::describe(OptionVisitor& visitor) {
  visitor.number("counts_per_s", counts_per_s, {0, 1e9}, "mean detections a second; 0: none");
  visitor.number("frequency_hz", frequency_hz, {1, 1e10}, "repetition frequency of its pulses, Hz");
  visitor.number("sigma_ps", sigma_ps, {0, 1e6}, "standard deviation of its detected pulses, ps");
}

ForeignStream::ForeignStream(const ForeignOptions& options, std::uint64_t seed)
    : period_ps_(ps_per_s / options.frequency_hz),
      counts_per_pulse_(options.counts_per_s / options.frequency_hz),
      sigma_ps_(options.sigma_ps),
      random_(seed, foreign_stream) {
  if (!(counts_per_pulse_ > 0)) return;
  pulse_.advance(-Random::largest_normal * sigma_ps_ - period_ps_ * random_.uniform());
  next_photon();
}

// Detections are a Poisson process in the accumulated light, as those of a SignalStream are.
void ForeignStream::next_photon() {
  since_pulse_ += random_.exponential();
  const double pulses = std::floor(since_pulse_ / counts_per_pulse_);
  since_pulse_ -= pulses * counts_per_pulse_;
  pulse_.advance_far(pulses * period_ps_);
}

void ForeignStream::fill(std::int64_t until_ps) {
  pending_.compact();
  if (!(counts_per_pulse_ > 0)) return;
  const FineTime settled = FineTime{until_ps, 0}.after(Random::largest_normal * sigma_ps_ + 1);
  while (pulse_.ps < settled.ps) {
    const double late_ps = sigma_ps_ > 0 ? sigma_ps_ * random_.normal() : 0;
    const std::int64_t time_ps = pulse_.after(late_ps).rounded_ps();
    if (time_ps >= 0) pending_.insert(time_ps);
    next_photon();
  }
}

}  // namespace splid::simulator
