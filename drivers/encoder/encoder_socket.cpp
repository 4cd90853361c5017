#include <pthread.h>

#include <algorithm>
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
#include "drivers/encoder/failure_news.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds read_slice{20};
constexpr std::size_t encoder_buffer_bytes = 1 << 16;
constexpr std::size_t longest_line_bytes = 1 << 20;

// The pause before a connection is made anew. It doubles from one connection without counts to the
// next.
constexpr milliseconds encoder_pause{500};
constexpr milliseconds longest_encoder_pause{8000};

// The most that may wait to be taken, some 50 MB: an hour of 100 batches a second, or of 1 kHz.
constexpr std::size_t most_batches = 360'000;
constexpr std::size_t most_counts = 1 << 22;

class EncoderSocket final : public EncoderSource {
  using Clock = std::chrono::steady_clock;

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
    waiting_counts_ -= batch.counts.size();
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
      const std::size_t searched = text_.size();
      text_.append(reinterpret_cast<const char*>(buffer.data()), bytes);
      take_lines(searched);
      if (!socket_.is_open()) pause(stop);
    }
  }

  void connect(const std::stop_token& stop) {
    text_.clear();
    if (!socket_.connect(stop)) pause(stop);
  }

  // Says why the connection ended or was not made, and waits before the next.
  void pause(const std::stop_token& stop) {
    if (stop.stop_requested()) return;
    if (const auto news = news_.say("encoder: " + socket_.failure(), Clock::now())) warn_(*news);
    for (auto left = pause_; left > left.zero() && !stop.stop_requested(); left -= read_slice) {
      std::this_thread::sleep_for(read_slice);
    }
    pause_ = std::min(2 * pause_, longest_encoder_pause);
  }

  // searched: the bytes of text_ that have no line feed.
  void take_lines(std::size_t searched) {
    std::size_t begin = 0;
    for (std::size_t end = searched; (end = text_.find('\n', end)) != std::string::npos;) {
      if (!take_line(std::string_view(text_).substr(begin, end - begin))) return;
      begin = ++end;
    }
    text_.erase(0, begin);
    if (text_.size() > longest_line_bytes) socket_.end("a line has no end after 1 MiB");
  }

  bool take_line(std::string_view line) {
    std::optional<EncoderBatch> batch = parse_encoder_line(line);
    if (!batch) {
      socket_.end("\"" + shown_text(line, 40) +
                  "\" is not FIRST_INDEX,COUNT[,COUNT...] nor overrun");
      return false;
    }
    if (batch->counts.empty() && !batch->overrun) return true;
    pause_ = encoder_pause;
    news_.over();
    const std::lock_guard lock(mutex_);
    // The gap in the index shows that batches were dropped here.
    if (batches_.size() >= most_batches) return true;
    if (waiting_counts_ + batch->counts.size() > most_counts) return true;
    waiting_counts_ += batch->counts.size();
    batches_.push_back(std::move(*batch));
    return true;
  }

  // These are for thread_ only.
  ClientSocket socket_;
  std::string text_;  // what came since the last line feed
  FailureNews news_;
  milliseconds pause_ = encoder_pause;
  std::function<void(const std::string&)> warn_;
  std::mutex mutex_;
  std::deque<EncoderBatch> batches_;  // guarded by mutex_
  std::size_t waiting_counts_ = 0;    // in batches_; guarded by mutex_
  std::jthread thread_;               // the last member, so that the thread ends first
};

}  // namespace

std::unique_ptr<EncoderSource> open_encoder_socket(const std::string& address,
                                                   std::function<void(const std::string&)> warn) {
  return std::make_unique<EncoderSocket>(address, std::move(warn));
}

}  // namespace splid
