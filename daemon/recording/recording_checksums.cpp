#include "daemon/recording/recording_checksums.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "daemon/base/sha256.hpp"
#include "protocol/error.hpp"

namespace splid::recording {
namespace {

constexpr std::size_t most_waiting = 64;
constexpr int lowest_priority = 19;

}  // namespace

Checksums::Checksums(Say say)
    : say_(std::move(say)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

Checksums::~Checksums() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void Checksums::add(std::unique_ptr<FrameTable> table, std::string recording) {
  std::string dropped;
  {
    const std::scoped_lock lock(mutex_);
    // The first is being read.
    if (waiting_.size() >= most_waiting) {
      dropped = std::move(waiting_[1].recording);
      for (std::size_t i = 2; i < waiting_.size(); ++i) waiting_[i - 1] = std::move(waiting_[i]);
      waiting_.pop_back();
    }
    waiting_.push_back({std::move(table), std::move(recording)});
  }
  changed_.notify_all();
  if (!dropped.empty()) give_up(dropped);
}

void Checksums::finish(const std::stop_token& stop,
                       std::optional<std::chrono::milliseconds> patience) {
  {
    std::unique_lock lock(mutex_);
    const auto all_done = [this] { return waiting_.empty(); };
    if (patience) {
      changed_.wait_for(lock, stop, *patience, all_done);
    } else {
      changed_.wait(lock, stop, all_done);
    }
  }
  thread_.request_stop();
  thread_.join();
  for (const Entry& entry : waiting_) give_up(entry.recording);
  waiting_.clear();
}

void Checksums::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "checksum");
  // Of this thread alone, as Linux has it. Where it is refused the thread stays as the others are.
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), lowest_priority);
  for (;;) {
    const Entry* entry = nullptr;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) return;
      entry = &waiting_.front();
    }
    // Elements of a deque stay where they are while others are put behind them, and add() leaves
    // the first where it is.
    write(*entry, stop);
    if (stop.stop_requested()) return;
    {
      const std::scoped_lock lock(mutex_);
      waiting_.pop_front();
    }
    changed_.notify_all();
  }
}

void Checksums::write(const Entry& entry, const std::stop_token& stop) {
  const std::optional<std::string> checksum = sha256_of_file(entry.recording, stop);
  if (!checksum) {
    std::error_code unknown;
    const bool is_there = std::filesystem::exists(entry.recording, unknown);
    if (is_there && !stop.stop_requested()) give_up(entry.recording);
    return;
  }
  try {
    entry.table->write_checksum(*checksum);
  } catch (const Error& error) {
    say_(error.what());
  }
}

void Checksums::give_up(const std::string& recording) const {
  say_("the table of " + recording +
       " stays without the recording's SHA-256, which was not ready in time; sha256sum prints it");
}

}  // namespace splid::recording
