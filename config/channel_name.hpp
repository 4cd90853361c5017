#pragma once

#include <optional>
#include <string>

#include "protocol/tag.hpp"

namespace splid {

// Which tags a channel name of the configuration stands for.
struct ChannelName {
  TagKind kind = TagKind::photon;  // photon: an input; or sync or marker
  int value = 0;                   // input number, or marker bits 1 to 15; 0 for sync

  // True for the tags of this channel. A marker tag must have all marker bits of the name.
  [[nodiscard]] constexpr bool matches(const Tag& tag) const {
    if (tag.kind != kind) return false;
    if (kind == TagKind::marker) return (tag.value & value) == value;
    return kind == TagKind::sync || tag.value == value;
  }
};

// The inputs that a name may give. Some instruments give falling edges negative numbers.
inline constexpr int min_input = -128;
inline constexpr int max_input = 126;

// Reads `sync`, `marker:1` to `marker:15`, or an input number. Absent for any other text.
std::optional<ChannelName> parse_channel(const std::string& name);

// True if some tag would belong to both channels.
bool overlap(const ChannelName& a, const ChannelName& b);

}  // namespace splid
