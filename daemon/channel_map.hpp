#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "config/daemon_options.hpp"
#include "protocol/tag.hpp"

namespace splid {

// What the framer does with a tag.
enum class Role : std::uint8_t {
  ignored,          // an event on a channel that the configuration does not name
  photon,           //
  sync,             //
  marker,           // of the encoder
  sync_and_marker,  // marker bits that hold both channels
  control,          // no event: heartbeat, loss, missed, clock_break
};

// From a tag's kind and value to its role, by table: names of the configuration become numbers
// once, at start.
//
// A marker tag belongs to `marker:N` when it has all bits of N: instruments put markers that come
// together into one record.
class ChannelMap {
 public:
  // Errors: Error(Fault::usage) naming the JSON pointer, the value and the bound, for a name that
  // is none, for an input outside -128 ... 126 and for a channel with two roles.
  explicit ChannelMap(const ChannelOptions& options);

  // Threads: any; the map is constant.
  [[nodiscard]] Role role(const Tag& tag) const {
    // Design note: values are shifted by 128 so that falling edges, which some taggers number
    // negatively, have their places; all beyond share the last one, which stays `ignored`.
    const auto column = std::min(static_cast<std::uint32_t>(tag.value) + 128U, 255U);
    return roles_[(static_cast<std::uint32_t>(tag.kind) & 7U) * 256U + column];
  }

 private:
  void assign(const std::string& pointer, const std::string& name, Role role);
  void set(const std::string& pointer, const std::string& name, TagKind kind, int value, Role role);

  std::array<Role, std::size_t{8} * 256> roles_{};
};

}  // namespace splid
