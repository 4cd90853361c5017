#include "estimator/several/range_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace splid {
namespace {

// From a start that is off by a width, two targets 3 widths apart come to within a tenth of a width
// of their places in so many rounds.
constexpr int rounds = 8;
// Light in so many bins together, which are three widths, is taken for that of one more target.
constexpr std::size_t bins_of_one = 6;
constexpr double least_deviations = 6;

}  // namespace

RangeProfile::RangeProfile(const PulseShape& shape)
    : shape_(shape), bin_ns_(bin_widths * shape.width_ns()) {
  for (std::size_t i = 0; i < bins; ++i) {
    places_ns_[i] = shape.peak_offset_ns() + first_widths * shape.width_ns() +
                    (static_cast<double>(i) + 0.5) * bin_ns_;
  }
}

void RangeProfile::see(const Counts& counts, double dark) {
  counts_ = counts;
  dark_ = dark;
}

void RangeProfile::light_of(const Target& target, Counts& light) {
  for (std::size_t i = 0; i < bins; ++i) offsets_ns_[i] = places_ns_[i] - target.offset_ns;
  shape_.evaluate(offsets_ns_, {light, d1_, d2_});
  for (double& photons : light) photons *= target.photons * bin_ns_;
}

const RangeProfile::Counts& RangeProfile::light_of_all(const Row& row) {
  const auto targets = row.all();
  all_.fill(dark_);
  for (std::size_t k = 0; k < targets.size(); ++k) {
    light_of(targets[k], light_[k]);
    for (std::size_t i = 0; i < bins; ++i) all_[i] += light_[k][i];
  }
  return all_;
}

// A target moves by as much as the middle of the photons that are its own is off from the middle of
// its light.
void RangeProfile::settle(Row& row) {
  const auto targets = row.all();
  for (int round = 0; round < rounds; ++round) {
    const Counts& all = light_of_all(row);
    for (std::size_t k = 0; k < targets.size(); ++k) {
      double photons = 0, place = 0, light = 0, middle = 0;
      for (std::size_t i = 0; i < bins; ++i) {
        const double own = all[i] > 0 ? counts_[i] * light_[k][i] / all[i] : 0;
        photons += own;
        place += own * places_ns_[i];
        light += light_[k][i];
        middle += light_[k][i] * places_ns_[i];
      }
      if (!(photons > 0 && light > 0)) continue;
      targets[k].offset_ns += place / photons - middle / light;
      targets[k].photons *= photons / light;
    }
  }
}

void RangeProfile::add_unexplained(Row& row, std::size_t most, double least_of_weakest) {
  while (row.count() < most) {
    const auto next = unexplained(row, least_of_weakest);
    if (!next) return;
    row.add(*next);
    settle(row);
  }
}

double RangeProfile::nats(const Row& row) {
  const Counts& all = light_of_all(row);
  double sum = 0;
  for (std::size_t i = 0; i < bins; ++i) {
    sum += (counts_[i] > 0 ? counts_[i] * std::log(all[i]) : 0) - all[i];
  }
  return sum;
}

std::optional<RangeProfile::Target> RangeProfile::unexplained(const Row& row,
                                                              double least_of_weakest) {
  const Counts& all = light_of_all(row);
  double weakest = std::numeric_limits<double>::infinity();
  for (const Target& target : row.all()) weakest = std::min(weakest, target.photons);
  Target most;
  for (std::size_t first = 0; first + bins_of_one <= bins; ++first) {
    double expected = 0, excess = 0, place = 0;
    for (std::size_t i = first; i < first + bins_of_one; ++i) {
      const double more = counts_[i] - all[i];
      expected += all[i];
      excess += more;
      place += more * places_ns_[i];
    }
    if (excess < least_deviations * std::sqrt(std::max(expected, 1.0))) continue;
    if (excess < least_of_weakest * weakest || excess <= most.photons) continue;
    most = {place / excess - shape_.peak_offset_ns(), excess};
  }
  return most.photons > 0 ? std::optional(most) : std::nullopt;
}

}  // namespace splid
