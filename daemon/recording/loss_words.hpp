#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>

#include "daemon/base/text.hpp"
#include "protocol/tag.hpp"

namespace splid::recording {

// The sum of the known counts.
inline std::uint64_t known_lost_tags(std::span<const Loss> losses) {
  std::uint64_t known = 0;
  for (const Loss& loss : losses) {
    known += static_cast<std::uint64_t>(std::max<std::int64_t>(loss.count, 0));
  }
  return known;
}

// How many of the losses have no known count.
inline std::uint64_t uncounted_losses(std::span<const Loss> losses) {
  return static_cast<std::uint64_t>(
      std::count_if(losses.begin(), losses.end(), [](const Loss& loss) { return loss.count < 0; }));
}

// What StrayTimes took out, after its number.
inline constexpr const char* strays_in_words = " tags had a time far ahead of all others";

// "12 tags lost; losses of an unknown number of tags: 3", the latter where there are any.
inline std::string lost_in_words(std::uint64_t tags, std::uint64_t uncounted) {
  std::string text = grouped(tags) + " tags lost";
  if (uncounted > 0) {
    text += "; losses of an unknown number of tags: " + grouped(uncounted);
  }
  return text;
}

}  // namespace splid::recording
