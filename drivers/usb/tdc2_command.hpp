#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace splid::usb {

// The commands that the S-Fifteen TDC2 (timestamp7) takes on its command endpoint. Source:
// readevents7 and the usbtmst4 driver, which are both public.
enum class Tdc2Command : std::uint8_t {
  write_config = 54,      // u16: bits of tdc2_config. No reply
  start_stream = 55,      // reply: u8, 0: started, else busy
  stop_stream = 57,       // no reply
  flush = 60,             // sends the data that wait in a packet that is not full. No reply
  reset_transfer = 61,    // no reply
  write_parameters = 64,  // two u16, of the converter and of the output. No reply
  power_state = 66,       // reply: u8, bits of tdc2_power
  status_word = 67,       // reply: u32; all bits are 1 where it cannot be read
  write_threshold = 68,   // u16: bits 15 to 12 the converter's output, 11 to 0 its value. No reply
  read_ram = 81,          // u32: byte address. Reply: u32, the word in its upper half
  load_table = 82,        // EEPROM to RAM. Reply: u8, 0: done
  push_table = 84,        // RAM to FPGA. No reply
  configure = 85,         // u8: 0 off, 1 power, 2 booted. No reply
};

// Bits of the configuration word.
namespace tdc2_config {
inline constexpr std::uint16_t lamp = 1U << 0U;
inline constexpr std::uint16_t collect = 1U << 1U;
inline constexpr std::uint16_t counter_reset = 1U << 2U;
inline constexpr std::uint16_t fifo_reset = 1U << 3U;
inline constexpr std::uint16_t dummies = 1U << 5U;
inline constexpr std::uint16_t select_parameters = 1U << 7U;
}  // namespace tdc2_config

// Bits of the power state.
namespace tdc2_power {
inline constexpr std::uint8_t table_loaded = 0x01;
inline constexpr std::uint8_t powered = 0x20;
inline constexpr std::uint8_t booted = 0x80;
}  // namespace tdc2_power

// The bytes of a command: its length, the command, its arguments, and last the sum of all these.
std::vector<std::byte> tdc2_command(Tdc2Command command,
                                    std::initializer_list<std::uint8_t> arguments = {});
// A command with an argument of two bytes, little endian.
std::vector<std::byte> tdc2_command16(Tdc2Command command, std::uint16_t argument);
// A command with an argument of four bytes, little endian.
std::vector<std::byte> tdc2_command32(Tdc2Command command, std::uint32_t argument);

// The threshold of an input, 1 to 4, as the argument of write_threshold. threshold_mv: -1024 to
// 2047.25, in steps of 0.75 mV, rounded to the nearest.
std::uint16_t tdc2_threshold(int input, double threshold_mv);
// The edge that an input waits for, as the argument of write_threshold: a falling edge for
// thresholds up to -0.25 mV, as NIM pulses have, and a rising edge for higher thresholds.
std::uint16_t tdc2_polarity(int input, double threshold_mv);

}  // namespace splid::usb
