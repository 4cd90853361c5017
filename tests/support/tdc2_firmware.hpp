#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/tags16_block.hpp"
#include "tests/support/usb_double.hpp"

namespace splid::test {

// What the double can be told to do wrong.
struct Tdc2Faults {
  bool table_lost = false;     // not in its RAM until loaded from the EEPROM
  bool table_damaged = false;  // does not load at all
  bool busy = false;           // does not start
  bool mute = false;           // answers no command
  // In its RAM: a count, as many words, and a word that makes the sum zero.
  std::vector<std::uint16_t> parameters = {2, 0x8011, 0x0001, 0x7FEC};
};

// A TDC2 as its public host programs know it: follows the command sequence, refuses to send before
// all of it was done, and then sends records of one event on input 1 every 10 us of the host's
// time, each tenth on input 4 too, with a dummy each millisecond.
//
// Threads: the double's for the firmware's members, any for the rest; locks.
class Tdc2Firmware final : public UsbFirmware {
 public:
  static constexpr std::uint64_t unit_per_us = 256'000;
  static constexpr std::uint64_t gap_us = 10;

  void set(const Tdc2Faults& faults) {
    const std::lock_guard lock(mutex_);
    faults_ = faults;
  }
  void set_status(std::uint32_t word) {
    const std::lock_guard lock(mutex_);
    status_ = word;
  }
  // No events and no dummies: darkness, of an instrument that knows no dummies.
  void set_dark(bool dark) {
    const std::lock_guard lock(mutex_);
    dark_ = dark;
  }
  void send(std::vector<std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    inserted_ = std::move(bytes);
  }
  // From now on so many bytes are missing, and records do not begin where transfers do, until its
  // memory is emptied.
  void slip(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    missing_ = bytes;
    slipped_ = true;
  }
  // What was wrong with the commands, a sentence each.
  [[nodiscard]] std::vector<std::string> complaints() const {
    const std::lock_guard lock(mutex_);
    return complaints_;
  }
  // Commands' numbers in their order, without the status word's and the flush.
  [[nodiscard]] std::vector<int> commands() const {
    const std::lock_guard lock(mutex_);
    return commands_;
  }
  // Arguments of the commands that write thresholds.
  [[nodiscard]] std::vector<std::uint32_t> thresholds() const {
    const std::lock_guard lock(mutex_);
    return thresholds_;
  }
  // Arguments of the commands that write parameters.
  [[nodiscard]] std::vector<std::uint32_t> parameters() const {
    const std::lock_guard lock(mutex_);
    return parameters_;
  }
  // How often its status word was asked for while it answered no command.
  [[nodiscard]] int unanswered_polls() const {
    const std::lock_guard lock(mutex_);
    return unanswered_polls_;
  }
  [[nodiscard]] bool streams() const {
    const std::lock_guard lock(mutex_);
    return streaming_;
  }

  void power_on() override {
    const std::lock_guard lock(mutex_);
    booted_ = streaming_ = collecting_ = table_pushed_ = table_loaded_ = false;
    setting_ = 0;
    replies_.clear();
  }
  void halt_cleared(std::uint8_t) override {}
  void alternate_selected(int setting) override {
    const std::lock_guard lock(mutex_);
    setting_ = setting;
  }

  void written(std::uint8_t endpoint, std::span<const std::byte> bytes) override {
    const std::lock_guard lock(mutex_);
    if (endpoint != 0x01) complain("command on another endpoint");
    if (setting_ != 1) complain("alternate setting 1 was not selected");
    unsigned sum = 0;
    for (const std::byte byte : bytes.first(bytes.size() - 1)) {
      sum += std::to_integer<unsigned>(byte);
    }
    if (bytes.size() < 3 || std::to_integer<std::size_t>(bytes[0]) != bytes.size()) {
      complain("wrong length");
      return;
    }
    if (std::to_integer<unsigned>(bytes.back()) != (sum & 0xFFU)) complain("wrong checksum");
    std::uint32_t argument = 0;
    for (std::size_t i = 2; i + 1 < bytes.size(); ++i) {
      argument |= std::to_integer<std::uint32_t>(bytes[i]) << 8 * (i - 2);
    }
    take(std::to_integer<int>(bytes[1]), argument);
  }

  std::optional<Answer> read(std::uint8_t endpoint, std::span<std::byte> room) override {
    const std::lock_guard lock(mutex_);
    if (endpoint == 0x81) return reply(room);
    if (!inserted_.empty()) {
      const std::size_t count = std::min(inserted_.size(), room.size());
      std::copy_n(inserted_.begin(), count, room.begin());
      inserted_.clear();
      return Answer{count, 0};
    }
    if (!streaming_ || !collecting_) return std::nullopt;
    return records(room);
  }

 private:
  void complain(const std::string& what) { complaints_.push_back(what); }

  void take(int command, std::uint32_t argument) {
    if (command != 67 && command != 60) commands_.push_back(command);
    unanswered_polls_ += faults_.mute && command == 67 ? 1 : 0;
    if (faults_.mute && command != 54) return;
    switch (command) {
      case 54:
        configure(argument);
        break;
      case 55:
        start();
        break;
      case 57:
        streaming_ = false;
        break;
      case 60:
      case 61:
        break;
      case 64:
        parameters_.push_back(argument);
        break;
      case 66:
        answer({static_cast<std::uint8_t>((booted_ ? 0xA0 : 0x20) | (table_loaded_ ? 1 : 0))});
        break;
      case 67:
        answer32(status_);
        break;
      case 68:
        thresholds_.push_back(argument);
        break;
      case 81:
        answer32(static_cast<std::uint32_t>(ram(argument)) << 16U);
        break;
      case 82:
        table_loaded_ = !faults_.table_damaged;
        answer({std::uint8_t(faults_.table_damaged ? 0xFF : 0)});
        break;
      case 84:
        if (!table_loaded_) complain("table pushed before it was loaded");
        table_pushed_ = true;
        break;
      case 85:
        booted_ = argument == 2;
        table_loaded_ = !faults_.table_lost && !faults_.table_damaged;
        break;
      default:
        complain("unknown command " + std::to_string(command));
    }
  }

  void configure(std::uint32_t word) {
    if (!booted_) complain("configured before it was booted");
    collecting_ = (word & 2U) != 0;
    dummies_ = (word & 0x20U) != 0;
    if ((word & 4U) != 0) us_ = 0;
    if ((word & 8U) != 0) {
      began_ = {};
      slipped_ = false;
      left_.clear();
    }
    if (collecting_ && (!table_pushed_ || thresholds_.size() < 8)) {
      complain("started before table and thresholds were there");
    }
  }

  void start() {
    if (!collecting_) complain("stream started before collection");
    streaming_ = !faults_.busy;
    began_ = std::chrono::steady_clock::now();
    answer({std::uint8_t(faults_.busy ? 1 : 0)});
  }

  [[nodiscard]] std::uint16_t ram(std::uint32_t address) const {
    const std::uint32_t index = (address - 4096) / 2;
    return index < faults_.parameters.size() ? faults_.parameters.at(index) : std::uint16_t{0};
  }

  void answer(std::vector<std::uint8_t> bytes) { replies_.push_back(std::move(bytes)); }
  void answer32(std::uint32_t word) {
    answer({std::uint8_t(word & 0xFFU), std::uint8_t(word >> 8U & 0xFFU),
            std::uint8_t(word >> 16U & 0xFFU), std::uint8_t(word >> 24U)});
  }

  std::optional<Answer> reply(std::span<std::byte> room) {
    if (replies_.empty()) return std::nullopt;
    const std::vector<std::uint8_t> bytes = std::move(replies_.front());
    replies_.pop_front();
    for (std::size_t i = 0; i < bytes.size(); ++i) room[i] = std::byte{bytes[i]};
    return Answer{bytes.size(), 0};
  }

  std::optional<Answer> records(std::span<std::byte> room) {
    const auto passed = std::chrono::duration_cast<std::chrono::microseconds>(
        std::chrono::steady_clock::now() - began_);
    // A packet each millisecond: one for each record would keep the bus from answering commands.
    if (us_ + 1000 > static_cast<std::uint64_t>(passed.count())) return std::nullopt;
    std::vector<std::byte> bytes;
    for (; us_ + gap_us <= static_cast<std::uint64_t>(passed.count()); us_ += gap_us) {
      if (bytes.size() + 16 > room.size()) break;
      if (dark_) continue;
      const std::uint64_t units = us_ * unit_per_us;
      // 24: what the internal bits were seen to be.
      const std::uint64_t inputs = us_ % (10 * gap_us) == 0 ? 0b1001 : 0b0001;
      append_little_endian(units << 10U | 24U << 5U | inputs, bytes);
      if (dummies_ && us_ % 1000 == 0) append_little_endian(units << 10U | 1U << 4U, bytes);
    }
    if (slipped_) bytes = shifted(bytes);
    if (bytes.empty()) return std::nullopt;
    std::copy(bytes.begin(), bytes.end(), room.begin());
    return Answer{bytes.size(), 0};
  }

  // The whole records in the bytes that were left over and in these bytes; keeps the rest.
  std::vector<std::byte> shifted(const std::vector<std::byte>& bytes) {
    left_.insert(left_.end(), bytes.begin(), bytes.end());
    const std::size_t gone = std::min(std::exchange(missing_, 0), left_.size());
    left_.erase(left_.begin(), left_.begin() + static_cast<std::ptrdiff_t>(gone));
    const auto end = left_.begin() + static_cast<std::ptrdiff_t>(left_.size() / 8 * 8);
    std::vector<std::byte> whole(left_.begin(), end);
    left_.erase(left_.begin(), end);
    return whole;
  }

  mutable std::mutex mutex_;
  Tdc2Faults faults_;
  std::vector<std::string> complaints_;
  std::vector<int> commands_;
  std::vector<std::uint32_t> thresholds_;
  std::vector<std::uint32_t> parameters_;
  int unanswered_polls_ = 0;
  std::deque<std::vector<std::uint8_t>> replies_;
  std::vector<std::byte> inserted_;
  std::vector<std::byte> left_;
  std::size_t missing_ = 0;
  bool slipped_ = false;
  std::chrono::steady_clock::time_point began_;
  std::uint64_t us_ = 0;  // of the next event
  std::uint32_t status_ = 0;
  int setting_ = 0;
  bool booted_ = false, table_loaded_ = false, table_pushed_ = false;
  bool collecting_ = false, streaming_ = false, dummies_ = false, dark_ = false;
};

}  // namespace splid::test
