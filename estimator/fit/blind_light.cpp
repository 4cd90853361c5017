#include "estimator/fit/blind_light.hpp"

#include <utility>

#include "estimator/fit/likelihood.hpp"

namespace splid {

void offsets_on(const NearSet& near, const Exposure& exposure, DelayLine line,
                std::vector<double>& offsets_ns) {
  offsets_ns.resize(near.entries());
  const double dilation = exposure.scale / (1 - line.travel_ns / exposure.length_ns);
  const double delay = line.delay_ns - near.line.delay_ns;
  const double travel = line.travel_ns - near.line.travel_ns;
  for (std::size_t j = 0; j < offsets_ns.size(); ++j) {
    offsets_ns[j] = (near.residual_ns[j] - delay - travel * near.position[j]) * dilation;
  }
}

BlindLight::BlindLight(const PulseShape& shape, std::size_t max_photons, std::size_t most_entries)
    : shape_(shape), ends_(max_photons, most_entries), begins_(1024, 65536) {
  for (auto* scratch : {&offset_, &h_, &d1_, &d2_, &sum_}) scratch->reserve(most_entries);
}

void BlindLight::collect(const FoldedFrame& frame, const NearSet& photons,
                         std::span<const CombWindow> windows, const PulseTrain& train,
                         double gather_width_ns) {
  const BlindTime& blind = *frame.blind;
  share_ = blind.share;
  ends_.collect(blind.ends, windows, train, photons.line, gather_width_ns);
  begins_.collect(blind.begins, windows, train, photons.line);
  const NearSet::Passed at_ends = ends_.passed(blind.ends, windows, train);
  const NearSet::Passed at_photons = photons.passed(frame, windows, train);
  const NearSet::Passed at_begins = begins_.passed(blind.begins, windows, train);
  // How much the combs send on average from the begin to the end of each blind time: those of a
  // photon are taken as long as the dead time, each at the rate of its own comb. What the others
  // and the shortened ones differ from that is taken at the mean rate. That a straightened path
  // passes faster at one end of the frame than at the other is 1e-6 of it, and is left out.
  const double passing = 1 - photons.line.travel_ns / frame.length_ns;
  const double dead_ns = blind.dead_time_ns / frame.scale;
  const double other_ns =
      blind.blind_ns / blind.share / frame.scale - dead_ns * static_cast<double>(frame.size());
  const double mean =
      passing * (dead_ns * at_photons.amplitude_per_ns + other_ns * train.amplitude_per_ns);
  covered_ = mean + at_ends.amplitude - at_photons.amplitude - at_begins.amplitude;
}

void BlindLight::evaluate(const NearSet& edges, const Exposure& exposure, DelayLine line) {
  offsets_on(edges, exposure, line, offset_);
  for (auto* scratch : {&h_, &d1_, &d2_}) scratch->resize(offset_.size());
  shape_.evaluate(offset_, {h_, d1_, d2_});
}

BlindLight::Amplitude BlindLight::at(const NearSet& photons, const Values& at_photons,
                                     const Exposure& exposure, DelayLine line) {
  Amplitude sum;
  sum.value = covered_;
  add(photons, at_photons, -1, exposure, line, sum);
  for (const auto& [edges, sign] : {std::pair(&ends_, 1.0), std::pair(&begins_, -1.0)}) {
    evaluate(*edges, exposure, line);
    add(*edges, {offset_, h_, d1_}, sign, exposure, line, sum);
  }
  for (double* part : {&sum.value, &sum.d1, &sum.d2, &sum.d11, &sum.d12, &sum.d22}) {
    *part *= share_;
  }
  return sum;
}

// Adds the sum of a_p H over the edges. The derivatives of an offset are those in Likelihood.
void BlindLight::add(const NearSet& edges, const Values& values, double sign,
                     const Exposure& exposure, DelayLine line, Amplitude& sum) {
  sum_.resize(edges.entries());
  shape_.integrate(values.offset, sum_);
  const double one_less_g = 1 - line.travel_ns / exposure.length_ns;
  const double dilation = exposure.scale / one_less_g;
  const double turn = 1 / (one_less_g * exposure.length_ns);
  const double o1 = -dilation;
  const double o12 = -dilation * turn;
  for (std::size_t k = 0; k < edges.photons(); ++k) {
    for (std::size_t j = edges.first[k]; j < edges.first[k + 1]; ++j) {
      const double a = sign * edges.weight[k] * edges.amplitude[j];
      const double o2 = -dilation * edges.position[j] + values.offset[j] * turn;
      const double o22 = 2 * turn * o2;
      const double h = values.h[j];
      const double d1 = values.d1[j];
      sum.value += a * sum_[j];
      sum.d1 += a * h * o1;
      sum.d2 += a * h * o2;
      sum.d11 += a * d1 * o1 * o1;
      sum.d12 += a * (d1 * o1 * o2 + h * o12);
      sum.d22 += a * (d1 * o2 * o2 + h * o22);
    }
  }
}

}  // namespace splid
