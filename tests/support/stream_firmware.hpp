#pragma once

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tests/support/usb_double.hpp"

namespace splid::test {

// A device that sends what a supply gives it, and misbehaves when told to.
class StreamFirmware : public UsbFirmware {
 public:
  // Fills the room as far as there is something; 0 where there is nothing now.
  using Supply = std::function<std::size_t(std::span<std::byte>)>;

  explicit StreamFirmware(Supply supply) : supply_(std::move(supply)) {}

  // The next transfers end like this, one each, before any more is sent: -EPIPE halts the endpoint
  // until that is cleared, 0 is a transfer without bytes.
  void fail(int status, int times = 1) {
    const std::lock_guard lock(mutex_);
    failures_.insert(failures_.end(), static_cast<std::size_t>(times), status);
  }
  // The next transfer is these bytes.
  void send(std::vector<std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    inserted_ = std::move(bytes);
  }
  void set_silent(bool silent) {
    const std::lock_guard lock(mutex_);
    silent_ = silent;
  }
  // At most so many bytes a transfer: short ones.
  void set_most_bytes(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    most_bytes_ = bytes;
  }
  [[nodiscard]] int halts_cleared() const {
    const std::lock_guard lock(mutex_);
    return halts_cleared_;
  }

  std::optional<Answer> read(std::uint8_t, std::span<std::byte> room) override {
    const std::lock_guard lock(mutex_);
    if (halted_) return Answer{0, -EPIPE};
    if (!failures_.empty()) {
      const int status = failures_.front();
      failures_.pop_front();
      halted_ = status == -EPIPE;
      return Answer{0, status};
    }
    if (silent_) return std::nullopt;
    if (!inserted_.empty()) {
      const std::size_t count = std::min(room.size(), inserted_.size());
      std::copy_n(inserted_.begin(), count, room.begin());
      inserted_.clear();
      return Answer{count, 0};
    }
    const std::size_t count = supply_(room.first(std::min(room.size(), most_bytes_)));
    if (count == 0) return std::nullopt;
    return Answer{count, 0};
  }
  void written(std::uint8_t, std::span<const std::byte>) override {}
  void halt_cleared(std::uint8_t) override {
    const std::lock_guard lock(mutex_);
    halted_ = false;
    ++halts_cleared_;
  }
  void alternate_selected(int) override {}
  void power_on() override {
    const std::lock_guard lock(mutex_);
    halted_ = false;
  }

 private:
  mutable std::mutex mutex_;
  Supply supply_;
  std::deque<int> failures_;
  std::vector<std::byte> inserted_;
  bool silent_ = false;
  bool halted_ = false;
  std::size_t most_bytes_ = ~std::size_t{0};
  int halts_cleared_ = 0;
};

}  // namespace splid::test
