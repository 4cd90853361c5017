#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "daemon/base/file_descriptor.hpp"
#include "daemon/base/wake_descriptor.hpp"
#include "daemon/sockets/listening_socket.hpp"
#include "drivers/source.hpp"
#include "protocol/tags16_encode.hpp"

namespace splid::sockets {

// What a bridge does with the tags of its instrument: it serves them as tags16 blocks to one
// client, the newest, and tells that client how the instrument does.
//
// While the client is slow, up to 32 MiB wait, and then publish() waits, so that what comes
// meanwhile waits in the instrument. After `patience` blocks are dropped whole until the client
// reads again; their numbers tell it, as after a time without a client.
//
// Threads: claim() and publish() the source's; report() and published_ns() any; it has a thread of
// its own that sends. Errors: the constructor's as those of ListeningSocket.
class TagServer final : public TagSink {
 public:
  static constexpr std::chrono::milliseconds patience{500};

  // address: unix:PATH or tcp:HOST:PORT. key: the configuration key that it comes from.
  TagServer(const std::string& key, const std::string& address);
  ~TagServer() override;
  TagServer(const TagServer&) = delete;
  TagServer& operator=(const TagServer&) = delete;

  std::span<Tag> claim(std::size_t max_count) override;
  // A count of 0 sends an empty block where none was sent for 50 ms, or there is something to tell.
  void publish(std::size_t count) override;
  // Tells the client, and each client that comes later what holds.
  void report(const DeviceReport& report);
  // When publish() was last called, by the steady clock.
  [[nodiscard]] std::int64_t published_ns() const { return published_ns_; }

 private:
  struct Block {
    std::vector<std::byte> bytes;
    std::size_t size = 0;
    std::size_t sent = 0;
  };
  struct Saying {
    NoticeKind kind = NoticeKind::caution;
    std::string text;
  };

  bool tell();
  void say(Saying saying);
  Block take_room();
  bool queue(Block block, std::unique_lock<std::mutex>& lock);

  void serve(const std::stop_token& stop);
  void accept();
  void send();
  void drop_client();

  ListeningSocket listener_;
  WakeDescriptor wake_;
  Tags16Encoder encoder_;
  std::vector<Tag> room_;
  std::atomic<std::int64_t> published_ns_{0};
  std::int64_t sent_ns_ = 0;  // when the last block was made

  std::mutex mutex_;
  std::condition_variable has_room_;
  std::deque<Block> waiting_;  // the first may be under way; all below under the mutex
  std::vector<Block> spare_;
  bool has_client_ = false;
  bool is_stalled_ = false;  // the client did not read for `patience`
  std::uint64_t clients_ = 0;
  std::uint64_t told_clients_ = 0;  // of them, who know what holds
  Saying holds_;
  bool tells_again_ = false;     // what holds may have been in a block that was dropped
  std::vector<Saying> sayings_;  // to be told once

  FileDescriptor client_;  // the serving thread's
  std::jthread thread_;
};

}  // namespace splid::sockets
