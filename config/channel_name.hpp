#pragma once

#include <optional>
#include <string>

#include "protocol/tag.hpp"

namespace splid {

// Which tags a channel name of the configuration stands for.
struct ChannelName {
  TagKind kind = TagKind::photon;  // photon: an input; or sync or marker
  int value = 0;                   // input number, or marker bits 1 to 15; 0 for sync

  // True for the tags of this channel; of a marker tag all bits of the name must be set.
  [[nodiscard]] constexpr bool matches(const Tag& tag) const {
    if (tag.kind != kind) return false;
    if (kind == TagKind::marker) return (tag.value & value) == value;
    return kind == TagKind::sync || tag.value == value;
  }
};

// Inputs that a name may give; negative where an instrument numbers falling edges so.
inline constexpr int min_input = -128;
inline constexpr int max_input = 126;

// `sync`, `marker:1` to `marker:15`, or an input number. Null for anything else.
std::optional<ChannelName> parse_channel(const std::string& name);

// True if some tag would belong to both.
bool overlap(const ChannelName& a, const ChannelName& b);

}  // namespace splid
