#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace splid {

// Which input the photons of each of a recording's 64 channels came on. An input from 0 to 63 has
// the channel of its number where that is free. Any other input, such as a falling edge that its
// tagger numbers -1, gets a channel when it is first asked for: the highest free channel up to 62.
//
// Threads: one. Errors: none. No allocation but by text().
class PtuInputs {
 public:
  static constexpr std::size_t channels = 64;

  // least: 1 for splid's own recordings, which use channel 0 only when no other is left, since some
  // readers take it for the sync; 0 for a recording of another program, whose inputs keep their
  // numbers.
  explicit PtuInputs(int least = 1) : least_(least) { inputs_.fill(none); }

  // Absent where other inputs have all channels.
  std::optional<std::uint32_t> channel_of(std::int32_t input);
  // The channel's own number where it has no input yet.
  [[nodiscard]] std::int32_t input_of(std::size_t channel) const;

  // The text in a recording's header (tag Splid_Inputs): channel:input of each channel whose input
  // has another number, with spaces between, such as "61:-2 62:-1". At most `most_chars`.
  [[nodiscard]] std::string text() const;
  static constexpr std::size_t most_chars = channels * 15;
  // Reads such a text. Absent where it is no such list, or names a channel or an input twice.
  static std::optional<PtuInputs> from_text(std::string_view text, int least);

  friend bool operator==(const PtuInputs&, const PtuInputs&) = default;

 private:
  static constexpr std::int64_t none = std::numeric_limits<std::int64_t>::max();

  [[nodiscard]] std::optional<std::size_t> free_channel(std::int32_t input) const;

  int least_;
  std::array<std::int64_t, channels> inputs_{};  // none: not used yet
};

}  // namespace splid
