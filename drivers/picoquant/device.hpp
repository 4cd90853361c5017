#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/picoquant/library.hpp"
#include "drivers/picoquant/options.hpp"

namespace splid::picoquant {

// There is no instrument that could be opened.
class DeviceAbsent : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An instrument that is open and set as the options say. The destructor closes it.
//
// Threads: one. Errors: the constructor throws DeviceAbsent where there is none to open; everything
// throws LibraryError.
class Device {
 public:
  // serial: of the instrument to open; empty: any. library: outlives this object.
  Device(Library& library, const Options& options, const std::string& serial);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const std::string& serial() const { return serial_; }
  // "MultiHarp 150 1045678", for people.
  [[nodiscard]] const std::string& name() const { return name_; }
  // Of a time unit of the records.
  [[nodiscard]] double resolution_s() const { return resolution_s_; }

  void start();
  void stop();
  // The records that have come, as many as the library hands out at a time. Valid until the next
  // call.
  std::span<const std::byte> read();
  int flags();
  // Whether the measurement has come to the end that the library sets it.
  bool has_ended();
  // The library's warnings in one line; empty: none. Reads the rates, as the library asks for.
  std::string warnings();

 private:
  void find(const std::string& serial);
  void configure();
  void set_sync();
  void set_input(const InputOptions& input);
  void enable_inputs();
  void set_markers();
  [[nodiscard]] bool has_discriminators() const;
  [[nodiscard]] int level(const TriggerOptions& trigger) const;
  [[nodiscard]] int zero_cross(const TriggerOptions& trigger) const;

  Library& library_;
  const Options& options_;
  int index_ = -1;
  int inputs_ = 1;
  std::string model_;
  std::string serial_;
  std::string name_;
  double resolution_s_ = 0;
  std::vector<std::uint32_t> records_;
};

}  // namespace splid::picoquant
