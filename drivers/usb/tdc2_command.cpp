#include "drivers/usb/tdc2_command.hpp"

#include <algorithm>
#include <cmath>

namespace splid::usb {
namespace {

constexpr double lowest_mv = -1024;
constexpr double mv_per_step = 0.75;
constexpr double last_step = 4095;

// Above this step, -0.25 mV, an input waits for a rising edge.
constexpr int last_falling_step = 1365;

// The values that the outputs for the polarity are set to. The lines of every second input are
// swapped.
constexpr std::uint16_t polarity_high = 0xB0E;
constexpr std::uint16_t polarity_low = 0x72D;

constexpr std::uint8_t low_byte(std::uint32_t value) { return value & 0xFFU; }

int step_of(double threshold_mv) {
  return static_cast<int>(
      std::clamp(std::round((threshold_mv - lowest_mv) / mv_per_step), 0.0, last_step));
}

}  // namespace

std::vector<std::byte> tdc2_command(Tdc2Command command,
                                    std::initializer_list<std::uint8_t> arguments) {
  std::vector<std::byte> bytes{static_cast<std::byte>(arguments.size() + 3),
                               static_cast<std::byte>(command)};
  for (const std::uint8_t argument : arguments) bytes.push_back(static_cast<std::byte>(argument));
  unsigned sum = 0;
  for (const std::byte each : bytes) sum += std::to_integer<unsigned>(each);
  bytes.push_back(static_cast<std::byte>(sum));
  return bytes;
}

std::vector<std::byte> tdc2_command16(Tdc2Command command, std::uint16_t argument) {
  return tdc2_command(command, {low_byte(argument), low_byte(argument >> 8U)});
}

std::vector<std::byte> tdc2_command32(Tdc2Command command, std::uint32_t argument) {
  return tdc2_command(command, {low_byte(argument), low_byte(argument >> 8U),
                                low_byte(argument >> 16U), low_byte(argument >> 24U)});
}

std::uint16_t tdc2_threshold(int input, double threshold_mv) {
  const int output = 4 - input;  // the converter's outputs are wired in reverse
  return static_cast<std::uint16_t>(output << 12U | step_of(threshold_mv));
}

std::uint16_t tdc2_polarity(int input, double threshold_mv) {
  const int index = input - 1;
  const bool rising = step_of(threshold_mv) > last_falling_step;
  const bool swapped = index % 2 == 1;
  return static_cast<std::uint16_t>((index + 4) << 12U |
                                    (rising != swapped ? polarity_high : polarity_low));
}

}  // namespace splid::usb
