#include "protocol/ptu_inputs.hpp"

#include <algorithm>

#include "protocol/text.hpp"

namespace splid {
namespace {

constexpr std::size_t highest_given = 62;

bool is_channel(std::int64_t number) {
  return number >= 0 && number < static_cast<std::int64_t>(PtuInputs::channels);
}

}  // namespace

std::optional<std::uint32_t> PtuInputs::channel_of(std::int32_t input) {
  if (is_channel(input) && inputs_[static_cast<std::size_t>(input)] == input) return input;
  // From the end, where the inputs are that have another number.
  const auto found = std::find(inputs_.rbegin(), inputs_.rend(), input);
  if (found != inputs_.rend()) return static_cast<std::uint32_t>(inputs_.rend() - found - 1);
  const auto channel = free_channel(input);
  if (!channel) return std::nullopt;
  inputs_[*channel] = input;
  return static_cast<std::uint32_t>(*channel);
}

std::optional<std::size_t> PtuInputs::free_channel(std::int32_t input) const {
  const auto is_free = [this](std::size_t channel) { return inputs_[channel] == none; };
  if (input >= least_ && is_channel(input)) {
    const auto own = static_cast<std::size_t>(input);
    if (is_free(own)) return own;
  }
  for (std::size_t channel = highest_given; channel > 0; --channel) {
    if (is_free(channel)) return channel;
  }
  for (const std::size_t last : {channels - 1, std::size_t{0}}) {
    if (is_free(last)) return last;
  }
  return std::nullopt;
}

std::int32_t PtuInputs::input_of(std::size_t channel) const {
  const std::int64_t input = inputs_[channel];
  return static_cast<std::int32_t>(input == none ? static_cast<std::int64_t>(channel) : input);
}

std::string PtuInputs::text() const {
  std::string text;
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const std::int32_t input = input_of(channel);
    if (input == static_cast<std::int32_t>(channel)) continue;
    if (!text.empty()) text += ' ';
    text += std::to_string(channel) + ':' + std::to_string(input);
  }
  return text;
}

std::optional<PtuInputs> PtuInputs::from_text(std::string_view text, int least) {
  PtuInputs inputs(least);
  while (!text.empty()) {
    const auto channel = whole_number(take_until(text, ':'));
    const auto input = whole_number(take_until(text, ' '));
    if (!channel || !input || !is_channel(*channel)) return std::nullopt;
    if (*input != static_cast<std::int32_t>(*input)) return std::nullopt;
    const auto place = static_cast<std::size_t>(*channel);
    const bool is_new =
        std::find(inputs.inputs_.begin(), inputs.inputs_.end(), *input) == inputs.inputs_.end();
    if (inputs.inputs_[place] != none || !is_new) return std::nullopt;
    inputs.inputs_[place] = *input;
  }
  return inputs;
}

}  // namespace splid
