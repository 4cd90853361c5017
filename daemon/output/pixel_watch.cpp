#include "daemon/output/pixel_watch.hpp"

#include <algorithm>

namespace splid {
namespace {

constexpr double judged_after_ms = 1000;

// The median of those that count; 0 where none does.
template <class Pixels>
std::uint64_t median_photons(const Pixels& pixels) {
  std::vector<std::uint64_t> counts;
  for (const auto& pixel : pixels) {
    if (pixel.photons > 0) counts.push_back(pixel.photons);
  }
  if (counts.empty()) return 0;
  const auto middle = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
  std::nth_element(counts.begin(), middle, counts.end());
  return *middle;
}

void name_pixel(const std::string& name, std::size_t& count, std::vector<std::string>& names) {
  ++count;
  if (names.size() < PixelsStatus::most_named) names.push_back(name);
}

std::string listed_pixels(std::size_t count, const std::vector<std::string>& names) {
  std::string text = count == 1 ? "pixel " : "pixels ";
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (count > names.size()) text += " and " + std::to_string(count - names.size()) + " more";
  return text;
}

}  // namespace

void PixelWatch::add(const SceneMessage& scene) {
  now_.resize(scene.pixels.size());
  seen_.count = scene.pixels.size();
  seen_.by_status.clear();
  // All pixels share the lost tags but those that had no room.
  std::uint64_t shared = scene.whole.lost_tags.value_or(0);
  for (const auto& pixel : scene.pixels) {
    shared = std::min(shared, pixel.frame.lost_tags.value_or(0));
  }
  for (std::size_t i = 0; i < now_.size(); ++i) {
    const FrameMessage& frame = scene.pixels[i].frame;
    ++seen_.by_status[to_string(frame.status)];
    now_[i].photons += frame.photons.value_or(0);
    now_[i].overflows = now_[i].overflows || frame.lost_tags.value_or(0) > shared;
  }
  lasted_ms_ += scene.whole.duration_ms;
  if (lasted_ms_ >= judged_after_ms) judge(scene);
}

void PixelWatch::judge(const SceneMessage& scene) {
  seen_.dark = seen_.hot = 0;
  seen_.dark_names.clear();
  seen_.hot_names.clear();
  const std::uint64_t median = median_photons(now_);
  for (std::size_t i = 0; i < now_.size(); ++i) {
    const Pixel& pixel = now_[i];
    const std::string& name = scene.pixels[i].name;
    if (pixel.photons == 0) name_pixel(name, seen_.dark, seen_.dark_names);
    if (pixel.overflows || pixel.photons > hot_ratio * median) {
      name_pixel(name, seen_.hot, seen_.hot_names);
    }
  }
  now_.assign(now_.size(), {});
  lasted_ms_ = 0;
}

std::string in_words(const PixelsStatus& pixels) {
  std::string text;
  if (pixels.dark > 0) {
    text = listed_pixels(pixels.dark, pixels.dark_names) +
           (pixels.dark == 1 ? " counts" : " count") +
           " nothing: look at pixels/N/input and at the detector";
  }
  if (pixels.hot > 0) {
    text += (text.empty() ? "" : "; ") + listed_pixels(pixels.hot, pixels.hot_names) +
            (pixels.hot == 1 ? " counts" : " count") +
            " far more than the others or than there is room for: look at the detector, or raise "
            "pipeline.ring_capacity_tags";
  }
  return text;
}

}  // namespace splid
