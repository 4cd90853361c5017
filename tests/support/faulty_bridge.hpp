#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <mutex>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/bridge_server.hpp"
#include "tests/support/scene_records.hpp"
#include "tests/support/tags16_sender.hpp"

namespace splid::test {

// An instrument behind a bridge that plays a scene live, on a thread of its own, and misbehaves
// when told to.
//
// Threads: any.
class FaultyBridge {
 public:
  // Changes the records of each block from now on.
  using Damage = std::function<void(std::vector<Tags16Record>&)>;

  FaultyBridge(const std::string& path, SceneRecords scene)
      : sender(
            [this, scene = std::move(scene)](std::int64_t begin_ps, std::int64_t end_ps) mutable {
              std::vector<Tags16Record> records = scene(begin_ps, end_ps);
              const std::lock_guard lock(mutex_);
              if (damage_) damage_(records);
              return records;
            }),
        server_(path),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}

  [[nodiscard]] std::string address() const { return server_.address(); }

  void damage(Damage damage) {
    const std::lock_guard lock(mutex_);
    damage_ = std::move(damage);
  }
  // These bytes once, between two blocks.
  void insert(std::vector<std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    inserted_ = std::move(bytes);
  }
  void set_silent(bool silent) { silent_ = silent; }
  // Closes the connection. away: takes no other until this is false again.
  void hang_up(bool away) {
    away_ = away;
    hang_up_ = true;
  }
  void come_back() { away_ = false; }

 private:
  void run(const std::stop_token& stop) {
    std::vector<std::byte> room(1 << 20);
    bool connected = false;
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
      if (hang_up_.exchange(false)) {
        server_.hang_up();
        connected = false;
      }
      if (!connected) {
        connected = !away_ && server_.accept(20);
      } else if (!silent_) {
        connected = send(room);
      }
    }
  }

  bool send(std::span<std::byte> room) {
    const std::size_t count = sender(room);
    if (!server_.send(room.first(count))) return false;
    const std::vector<std::byte> inserted = [this] {
      const std::lock_guard lock(mutex_);
      return std::exchange(inserted_, {});
    }();
    return server_.send(inserted);
  }

  std::mutex mutex_;
  Damage damage_;                    // under the mutex
  std::vector<std::byte> inserted_;  // under the mutex
  std::atomic<bool> silent_{false};
  std::atomic<bool> hang_up_{false};
  std::atomic<bool> away_{false};

 public:
  Tags16Sender sender;

 private:
  BridgeServer server_;
  std::jthread thread_;
};

}  // namespace splid::test
