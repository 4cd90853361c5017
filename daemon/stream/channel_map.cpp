#include "daemon/stream/channel_map.hpp"

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace splid {
namespace {

ChannelName parsed(const std::string& name) { return parse_channel(name).value(); }

}  // namespace

ChannelMap::ChannelMap(const ChannelOptions& options) {
  if (const std::optional<OptionFault> fault = options.validate()) {
    throw Error(Fault::usage, "/channels" + fault->pointer + ": " + fault->what);
  }
  for (std::uint32_t kind = 0; kind < kinds; ++kind) {
    if (is_event(static_cast<TagKind>(kind))) continue;
    std::fill_n(&table_[std::size_t{kind} * columns], columns, role_control);
  }
  std::vector<ChannelName> photons;
  for (const std::int64_t input : options.pixels) {
    photons.push_back({TagKind::photon, static_cast<int>(input)});
  }
  if (photons.empty()) {
    for (const std::string& name : options.photon) photons.push_back(parsed(name));
  } else if (photons.size() > 1) {
    pixels_ = photons.size();
    input_.fill(static_cast<std::uint16_t>(pixels_));
  }
  for (const ChannelName& photon : photons) add(photon, role_photon, inputs_++);
  add(parsed(options.sync), role_sync);
  if (!options.encoder.empty()) add(parsed(options.encoder), role_marker);
  for (std::size_t i = 0; i < options.delays_ps.size(); ++i) {
    const ChannelName& input = photons.at(i);
    if (input.kind != TagKind::photon) continue;
    const auto column = static_cast<std::size_t>(input.value - least_pixel_input);
    delays_ps_.at(column) = std::llround(options.delays_ps[i]);
    has_delays_ = has_delays_ || delays_ps_.at(column) != 0;
  }
}

void ChannelMap::add(const ChannelName& channel, Roles role, std::size_t input) {
  const std::size_t row = static_cast<std::size_t>(channel.kind) * columns;
  for (std::uint32_t column = 0; column + 1 < columns; ++column) {
    const Tag tag{0, static_cast<std::int32_t>(column + least_pixel_input), channel.kind, {}};
    if (!channel.matches(tag)) continue;
    table_.at(row + column) |= role;
    if (role == role_photon) input_.at(row + column) = static_cast<std::uint16_t>(input);
  }
}

}  // namespace splid
