#include "daemon/service/found_values.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "daemon/base/text.hpp"

namespace splid {
namespace {

constexpr std::size_t most_values = 65'536;
constexpr double low = 0.05, high = 0.95;
constexpr double mm_per_m = 1e3, cmps_per_mps = 1e2;

// Decimals that show a tenth of this deviation, at most six.
int decimals_for(double deviation) {
  if (!(deviation > 0)) return 4;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(deviation))), 0, 6);
}

}  // namespace

void Sample::add(double value) {
  if (seen_++ % step_ != 0) return;
  values_.push_back(value);
  if (values_.size() < most_values) return;
  for (std::size_t i = 0; i < values_.size() / 2; ++i) values_[i] = values_[2 * i];
  values_.resize(values_.size() / 2);
  step_ *= 2;
}

double Sample::quantile(double fraction) const {
  std::vector<double> sorted = values_;
  const double place = fraction * static_cast<double>(sorted.size() - 1);
  const auto at = sorted.begin() + std::lround(place);
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

void FoundValues::take(const FrameMessage& frame) {
  if (!frame.valid() || !frame.distance_m) return;
  ++valid_;
  distance_m_.add(*frame.distance_m);
  if (frame.std_distance_m) std_distance_m_.add(*frame.std_distance_m);
  if (frame.velocity_mps) velocity_mps_.add(*frame.velocity_mps);
  if (frame.std_velocity_mps) std_velocity_mps_.add(*frame.std_velocity_mps);
}

std::string FoundValues::in_words() const {
  if (distance_m_.empty()) return "no frame has a distance";
  const auto deviation = [](const Sample& stds) { return stds.empty() ? 0 : stds.quantile(0.5); };
  const auto a_frame = [](double std, double factor, const char* unit) {
    return std > 0 ? fmt::format("; +- {:.2g} {} a frame", std * factor, unit) : std::string{};
  };
  const double std_m = deviation(std_distance_m_);
  std::string text =
      fmt::format("distance {:.{}f} m (median; 90 % of {} frames: {:.{}f} to {:.{}f} m{})",
                  distance_m_.quantile(0.5), decimals_for(std_m), grouped(valid_),
                  distance_m_.quantile(low), decimals_for(std_m), distance_m_.quantile(high),
                  decimals_for(std_m), a_frame(std_m, mm_per_m, "mm"));
  if (velocity_mps_.empty()) return text;
  const double std_mps = deviation(std_velocity_mps_);
  return text + fmt::format("; velocity {:+.{}f} m/s (median; 90 %: {:+.{}f} to {:+.{}f} m/s{})",
                            velocity_mps_.quantile(0.5), decimals_for(std_mps),
                            velocity_mps_.quantile(low), decimals_for(std_mps),
                            velocity_mps_.quantile(high), decimals_for(std_mps),
                            a_frame(std_mps, cmps_per_mps, "cm/s"));
}

}  // namespace splid
