#include "daemon/service/found_values.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/base/text.hpp"

namespace splid {
namespace {

constexpr std::size_t most_of_pixel = 256;
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
  if (values_.size() < most_) return;
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

void FoundPixels::take(const SceneMessage::Pixel& pixel) {
  Sample& distances_m = distances_m_.try_emplace(pixel.name, Sample(most_of_pixel)).first->second;
  ++by_status_.at(static_cast<std::size_t>(pixel.frame.status));
  if (pixel.frame.valid() && pixel.frame.distance_m) distances_m.add(*pixel.frame.distance_m);
}

std::string FoundPixels::in_words() const {
  if (distances_m_.empty()) return {};
  std::string text = fmt::format("frames of {} pixels", grouped(distances_m_.size()));
  const char* separator = ": ";
  for (std::size_t i = 0; i < by_status_.size(); ++i) {
    if (by_status_[i] == 0) continue;
    text += separator + grouped(by_status_[i]) + " " + frame_status_names[i];
    separator = ", ";
  }
  using Place = std::pair<double, std::string>;  // a median, of a pixel
  std::vector<Place> places;
  for (const auto& [name, distances_m] : distances_m_) {
    if (!distances_m.empty()) places.emplace_back(distances_m.quantile(0.5), name);
  }
  if (places.empty()) return text + "; no pixel measured";
  const auto [near, far] = std::minmax_element(places.begin(), places.end());
  return text + fmt::format("; {} measured, from {} at {:.6g} m to {} at {:.6g} m (medians)",
                            grouped(places.size()), near->second, near->first, far->second,
                            far->first);
}

}  // namespace splid
