#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace splid::test {

// What the double of a library of PicoQuant's (picoquant_double.cpp) is and does, and what it was
// told. It is in a file that the test and the double, in whichever process, both map; the
// environment variable SPLID_PICOQUANT_DOUBLE names it.
struct PicoQuantControl {
  // What is plugged in: a serial number for each index of OpenDevice; empty: nothing.
  std::array<std::array<char, 16>, 8> serials{};
  std::array<char, 32> model{};
  std::array<char, 16> library_version{};
  double resolution_ps = 1;
  std::int32_t inputs = 4;

  // The records: a file, from a place on. They come as the clock of a measurement goes on.
  std::array<char, 256> records_file{};
  std::uint64_t records_offset = 0;
  // Over and over: the records are of a whole number of the clock's wraps.
  bool loops = false;
  double speed = 1;                      // of the clock; 0: all records are there at once
  std::uint64_t fifo_records = 1 << 20;  // more that wait are too many: the FIFO is full

  // What goes wrong.
  std::atomic<std::int32_t> open_code{0};         // of OpenDevice
  std::atomic<std::int32_t> failing_code{0};      // of all calls of an open instrument
  std::atomic<std::int32_t> flags{0};             // of GetFlags, beside a FIFO that is full
  std::atomic<std::int32_t> fifo_is_full{0};      // once
  std::atomic<std::int32_t> measurement_ends{0};  // once
  std::atomic<std::int32_t> garbage_reads{0};     // so many reads give garbage
  std::atomic<std::int32_t> most_a_read{0};       // short reads; 0: as many as there are
  std::atomic<std::int32_t> is_silent{0};         // reads give nothing
  std::atomic<std::int32_t> hangs{0};             // the next read does not return
  std::atomic<std::int32_t> crashes{0};           // the next read ends the process
  std::atomic<std::int32_t> warnings{0};          // of GetWarnings

  // What it was told.
  std::atomic<std::uint64_t> starts{0};    // of measurements
  std::atomic<std::uint64_t> records{0};   // handed out, of all measurements
  std::atomic<std::uint64_t> was_full{0};  // how often the FIFO was
  std::atomic<std::uint64_t> hung{0};      // reads that did not return
  std::atomic<std::uint32_t> log_bytes{0};
  std::array<char, 1 << 14> log{};  // a line for each call but those that a measurement repeats
};

}  // namespace splid::test
