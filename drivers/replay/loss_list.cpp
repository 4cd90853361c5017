#include "drivers/replay/loss_list.hpp"

#include <algorithm>
#include <limits>

namespace splid {
namespace {

// A tag's value has 32 bits. Only a loss that many were joined to has a larger count.
std::int32_t clipped(std::int64_t count) {
  constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::min(count, most));
}

}  // namespace

LossList::LossList(std::span<const Loss> losses) {
  for (const Loss& loss : losses) {
    if (loss.begin_ps == loss.end_ps) {
      tags_.push_back({loss.begin_ps, clipped(loss.count), TagKind::missed, {}});
    } else {
      tags_.push_back({loss.begin_ps, 0, TagKind::loss_begin, {}});
      tags_.push_back({loss.end_ps, clipped(loss.count), TagKind::loss_end, {}});
    }
  }
  std::stable_sort(tags_.begin(), tags_.end(),
                   [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
}

}  // namespace splid
