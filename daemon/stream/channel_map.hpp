#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "config/channel_name.hpp"
#include "config/daemon_options.hpp"
#include "protocol/pixel.hpp"
#include "protocol/saturated.hpp"
#include "protocol/tag.hpp"

namespace splid {

// What the framer does with a tag: a sum of the roles below. It is 0 for an event on a channel that
// the configuration does not name. A marker tag may have several roles, since instruments put
// markers that come together into one record.
using Roles = std::uint8_t;
inline constexpr Roles role_photon = 1;
inline constexpr Roles role_sync = 2;
inline constexpr Roles role_marker = 4;   // of the encoder
inline constexpr Roles role_control = 8;  // not an event: heartbeat, loss, missed, clock_break

// Finds a tag's roles from its kind and value in a table, which is made once from the configured
// channel names.
class ChannelMap {
 public:
  // Errors: Error(Fault::usage) naming the JSON pointer, the value and the bound where
  // options.validate() finds a fault.
  explicit ChannelMap(const ChannelOptions& options);

  // Threads: any; the map is constant.
  [[nodiscard]] Roles roles(const Tag& tag) const { return table_[cell(tag)]; }

  // How many pixels have a part of a frame of their own, each with an input; 0: there is one pixel,
  // and all inputs are its.
  [[nodiscard]] std::size_t pixels() const { return pixels_; }
  // How many inputs photons come on, and on which of them, from 0, a photon came; of several pixels
  // pixels() for a tag that is no photon.
  [[nodiscard]] std::size_t inputs() const { return inputs_; }
  [[nodiscard]] std::size_t input(const Tag& photon) const { return input_[cell(photon)]; }

  // Whether a delay is configured for any photon input.
  [[nodiscard]] bool has_delays() const { return has_delays_; }
  // The tag with its input's delay subtracted from its time.
  [[nodiscard]] Tag undelayed(Tag tag) const {
    if (tag.kind != TagKind::photon) return tag;
    tag.time_ps = saturated_difference(tag.time_ps, delays_ps_[column(tag)]);
    return tag;
  }

 private:
  static constexpr std::uint32_t kinds = 8;
  static constexpr std::uint32_t columns = most_pixel_input - least_pixel_input + 2;

  // Design note: inputs -128 to 1024 have a column each (some taggers number falling edges
  // negatively). All other inputs share the last column, which no channel name means.
  static std::uint32_t column(const Tag& tag) {
    return std::min(
        static_cast<std::uint32_t>(tag.value) - static_cast<std::uint32_t>(least_pixel_input),
        columns - 1);
  }
  static std::uint32_t cell(const Tag& tag) {
    return (static_cast<std::uint32_t>(tag.kind) & (kinds - 1)) * columns + column(tag);
  }

  void add(const ChannelName& channel, Roles role, std::size_t input = 0);

  std::array<Roles, std::size_t{kinds} * columns> table_{};
  std::array<std::uint16_t, std::size_t{kinds} * columns> input_{};
  std::size_t inputs_ = 0;
  std::size_t pixels_ = 0;
  bool has_delays_ = false;
  std::array<std::int64_t, columns> delays_ps_{};  // of photon inputs
};

}  // namespace splid
