#include "estimator/selection/thinning.hpp"

#include <cmath>

namespace splid::selection {
namespace {

// A number in [0, 1) that a photon's place in its frame draws, the same on every machine
// (splitmix64, Steele et al. 2014).
double lot_of(std::uint64_t photon) {
  std::uint64_t x = (photon + 1) * 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return static_cast<double>((x ^ (x >> 31U)) >> 11U) * 0x1p-53;
}

}  // namespace

Thinning::Thinning(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                   double most_width)
    : shape_(shape),
      train_(train),
      windows_(comb_windows(train, most_width * shape.first_ns(), most_width * shape.last_ns())),
      near_(max_photons, max_photons * widest_overlap(windows_), true),
      rest_(train, max_photons) {
  const std::size_t entries = max_photons * widest_overlap(windows_);
  for (auto* values : {&offset_, &h_, &d1_, &d2_}) values->reserve(entries);
  for (auto* values : {&taken_, &kept_}) values->reserve(max_photons);
  stays_.reserve(max_photons);
}

const FoldedFrame& Thinning::rest(const FoldedFrame& frame, const likelihood::Model& model,
                                  std::size_t kept) {
  taken_.assign(frame.size(), 0);
  kept_.assign(frame.size(), model.background_per_ns);
  for (std::size_t k = 0; k < model.count; ++k) {
    add_light(frame, model, k, k == kept ? kept_ : taken_);
  }
  stays_.assign(frame.size(), 1);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (taken_[i] > 0) stays_[i] = lot_of(i) * (taken_[i] + kept_[i]) < kept_[i] ? 1 : 0;
  }
  rest_.take_some(stays_, frame);
  return rest_;
}

void Thinning::add_light(const FoldedFrame& frame, const likelihood::Model& model,
                         std::size_t target, std::vector<double>& light) {
  const likelihood::Target& own = model.targets.at(target);
  near_.collect(frame, windows_, train_, own.track);
  const double narrow = std::exp(-model.log_width);
  const double to_offset = frame.scale / (1 - own.track.walk_ns / frame.length_ns) * narrow;
  const std::size_t entries = near_.entries();
  for (auto* values : {&offset_, &h_, &d1_, &d2_}) values->resize(entries);
  for (std::size_t j = 0; j < entries; ++j) offset_[j] = near_.residual_ns[j] * to_offset;
  shape_.evaluate(offset_, {h_, d1_, d2_});
  for (std::size_t n = 0; n < near_.photons(); ++n) {
    for (std::size_t j = near_.first[n]; j < near_.first[n + 1]; ++j) {
      light[near_.index[n]] += own.signal_per_pulse * near_.amplitude[j] * narrow * h_[j];
    }
  }
}

}  // namespace splid::selection
