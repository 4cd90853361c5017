#include <pthread.h>

#include <chrono>
#include <cstddef>
#include <deque>
#include <mutex>
#include <span>
#include <stop_token>
#include <string_view>
#include <thread>
#include <utility>

#include "drivers/client_socket.hpp"
#include "drivers/encoder/encoder_source.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds read_slice{20};
constexpr int slices_between_attempts = 25;
constexpr std::size_t encoder_buffer_bytes = 1 << 16;
constexpr std::size_t longest_line_bytes = 1 << 20;

// The most batches that may wait to be taken: an hour of 100 a second.
constexpr std::size_t most_batches = 360'000;

class EncoderSocket final : public EncoderSource {
 public:
  EncoderSocket(const std::string& address, std::function<void(const std::string&)> warn)
      : socket_(address),
        warn_(std::move(warn)),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}

  bool next(EncoderBatch& batch) override {
    const std::lock_guard lock(mutex_);
    if (batches_.empty()) return false;
    batch = std::move(batches_.front());
    batches_.pop_front();
    return true;
  }

  [[nodiscard]] bool live() const override { return true; }

 private:
  void run(const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "encoder");
    std::vector<std::byte> buffer(encoder_buffer_bytes);
    while (!stop.stop_requested()) {
      if (!socket_.is_open()) {
        connect(stop);
        continue;
      }
      const std::size_t bytes = socket_.read(buffer, read_slice);
      text_.append(reinterpret_cast<const char*>(buffer.data()), bytes);
      take_lines();
      if (!socket_.is_open()) warn_once("encoder: " + socket_.failure());
    }
  }

  void connect(const std::stop_token& stop) {
    text_.clear();
    if (socket_.connect(stop)) {
      warned_.clear();
      return;
    }
    if (!stop.stop_requested()) warn_once("encoder: " + socket_.failure());
    for (int i = 0; i < slices_between_attempts && !stop.stop_requested(); ++i) {
      std::this_thread::sleep_for(read_slice);
    }
  }

  void take_lines() {
    std::size_t begin = 0;
    for (std::size_t end = 0; (end = text_.find('\n', begin)) != std::string::npos;) {
      if (!take_line(std::string_view(text_).substr(begin, end - begin))) return;
      begin = end + 1;
    }
    text_.erase(0, begin);
    if (text_.size() > longest_line_bytes) socket_.end("a line has no end after 1 MiB");
  }

  bool take_line(std::string_view line) {
    std::optional<EncoderBatch> batch = parse_encoder_line(line);
    if (!batch) {
      socket_.end("\"" + std::string(line.substr(0, 40)) +
                  "\" is not FIRST_INDEX,COUNT[,COUNT...] nor overrun");
      return false;
    }
    if (batch->counts.empty() && !batch->overrun) return true;
    const std::lock_guard lock(mutex_);
    // The gap in the index shows that batches were dropped here.
    if (batches_.size() < most_batches) batches_.push_back(std::move(*batch));
    return true;
  }

  void warn_once(const std::string& sentence) {
    if (sentence == warned_) return;
    warned_ = sentence;
    warn_(sentence);
  }

  // These are for thread_ only.
  ClientSocket socket_;
  std::string text_;    // what came since the last line feed
  std::string warned_;  // the sentence that was given last
  std::function<void(const std::string&)> warn_;
  std::mutex mutex_;
  std::deque<EncoderBatch> batches_;  // guarded by mutex_
  std::jthread thread_;               // the last member, so that the thread ends first
};

}  // namespace

std::unique_ptr<EncoderSource> open_encoder_socket(const std::string& address,
                                                   std::function<void(const std::string&)> warn) {
  return std::make_unique<EncoderSocket>(address, std::move(warn));
}

}  // namespace splid
