#include "estimator/paper/harmonic_power.hpp"

#include <algorithm>
#include <array>

namespace splid::paper {
namespace {

// So many photons have their bins computed in one loop of vectors.
constexpr std::size_t some_photons = 1024;

}  // namespace

HarmonicPower::HarmonicPower(const TrainPhotons& photons, std::size_t bins)
    : photons_(photons),
      bins_(bins),
      counts_(bins + 3),
      rests_(some_photons),
      cells_(some_photons) {}

// Design note: without SSE 4.1, floor() is a call into the library. Adding 1.5 * 2^52 and taking it
// off again rounds to a whole number, in vectors. Half a turn less is rounded to the whole turns
// below, or to either neighbour where the turns are whole; the photon is then at either end of the
// circle, which is the same place.
void HarmonicPower::add_photons(double rate, std::size_t first, std::size_t count) {
  constexpr double rounder = 0x1.8p52;
  const double turns_per_ns = 1 / photons_.period_ns;
  const auto bins = static_cast<double>(bins_);
  const double* phase_ns = photons_.phase_ns.data() + first;
  const double* time_ns = photons_.time_ns.data() + first;
  double* rests = rests_.data();
  std::int32_t* cells = cells_.data();
  for (std::size_t i = 0; i < count; ++i) {
    const double turns = (phase_ns[i] - rate * time_ns[i]) * turns_per_ns;
    const double place = (turns - (((turns - 0.5) + rounder) - rounder)) * bins;
    const auto cell = static_cast<std::int32_t>(place);
    cells[i] = cell;
    rests[i] = place - cell;
  }
  double* counts = counts_.data() + 1;
  for (std::size_t i = 0; i < count; ++i) {
    double* at = counts + cells[i];
    at[0] += 1 - rests[i];
    at[1] += rests[i];
  }
}

double HarmonicPower::operator()(double rate) {
  std::fill(counts_.begin(), counts_.end(), 0.0);
  for (std::size_t first = 0; first < photons_.size(); first += some_photons) {
    add_photons(rate, first, std::min(some_photons, photons_.size() - first));
  }
  counts_[1] += counts_[bins_ + 1];
  counts_[2] += counts_[bins_ + 2];
  counts_[bins_ + 1] = counts_[1];
  counts_[0] = counts_[bins_];
  // Several sums, as the additions to a single one would wait for each other.
  constexpr std::size_t lanes = 8;
  std::array<double, lanes> sums = {};
  std::size_t k = 0;
  const auto square = [&](std::size_t at) {
    const double smooth = counts_[at] + 2 * counts_[at + 1] + counts_[at + 2];
    return smooth * smooth;
  };
  for (; k + lanes <= bins_; k += lanes) {
    for (std::size_t lane = 0; lane < lanes; ++lane) sums[lane] += square(k + lane);
  }
  double power = 0;
  for (; k < bins_; ++k) power += square(k);
  for (const double sum : sums) power += sum;
  return power;
}

}  // namespace splid::paper
