#include "daemon/recording/frame_log.hpp"

#include <fmt/core.h>
#include <pthread.h>

#include <chrono>
#include <optional>
#include <utility>

#include "daemon/base/sha256.hpp"
#include "daemon/base/text.hpp"
#include "protocol/error.hpp"

namespace splid::recording {
namespace {

constexpr std::size_t max_waiting_frames = 4096;

// A killed program may lose a second of frames; writing twice as often leaves time for the disk.
constexpr std::chrono::milliseconds write_interval{400};

}  // namespace

FrameLog::FrameLog(const std::string& file, const TableFacts& facts, bool overwrite, Say say)
    : facts_(facts),
      say_(std::move(say)),
      waits_(true),
      table_(std::make_unique<FrameTable>(file, facts, overwrite)),
      tables_(1),
      last_file_(file),
      checksum_thread_([this](const std::stop_token& stop) {
        pthread_setname_np(pthread_self(), "checksum");
        checksum_ = sha256_of_file(facts_.recording, stop).value_or("");
      }),
      thread_([this] { run(); }) {}

FrameLog::FrameLog(TableFacts facts, Say say)
    : facts_(std::move(facts)),
      say_(std::move(say)),
      waits_(false),
      checksums_(std::in_place, say_),
      thread_([this] { run(); }) {}

FrameLog::~FrameLog() {
  std::stop_source now;
  now.request_stop();
  finish(now.get_token());
}

void FrameLog::put(const FrameMessage& frame, const std::string& file,
                   const std::string& recording) {
  std::unique_lock lock(mutex_);
  if (waits_) changed_.wait(lock, [this] { return queue_.size() < max_waiting_frames; });
  if (queue_.size() >= max_waiting_frames) {
    ++dropped_;
    return;
  }
  queue_.push_back({frame, file, recording});
  if (waits_ && queue_.size() == max_waiting_frames) changed_.notify_all();
}

void FrameLog::finish(const std::stop_token& stop,
                      std::optional<std::chrono::milliseconds> patience) {
  {
    const std::scoped_lock lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (checksums_) {
    end_table();
    checksums_->finish(stop, patience);
    checksums_.reset();
  }
  if (!checksum_thread_.joinable()) return;
  {
    const std::stop_callback pass_on(stop, [this] { checksum_thread_.request_stop(); });
    checksum_thread_.join();
  }
  finish_table();
}

void FrameLog::run() {
  pthread_setname_np(pthread_self(), "frames");
  std::deque<Entry> taken;
  for (bool over = false; !over;) {
    {
      std::unique_lock lock(mutex_);
      // Where the source waits for room in the queue, a full queue is taken at once.
      changed_.wait_for(lock, write_interval, [this] {
        return ended_ || (waits_ && queue_.size() >= max_waiting_frames);
      });
      over = ended_;
      taken.swap(queue_);
    }
    changed_.notify_all();
    for (const Entry& entry : taken) take(entry);
    taken.clear();
    flush();
    say_what_was_dropped();
  }
}

void FrameLog::take(const Entry& entry) {
  if (!waits_ && entry.file != last_file_) {
    flush();
    end_table();
    last_file_ = entry.file;
  }
  if (!table_ && may_make_) open(entry);
  if (!table_) {
    ++lost_;
    return;
  }
  table_->add(entry.frame);
}

// A frame of a live source that came before the first recording has no table.
void FrameLog::open(const Entry& entry) {
  if (entry.file.empty()) return;
  try {
    facts_.recording = entry.recording;
    table_ = std::make_unique<FrameTable>(entry.file, facts_, false);
    ++tables_;
  } catch (const std::exception& error) {
    may_make_ = false;
    lose(0, error.what());
  }
}

void FrameLog::flush() {
  may_make_ = true;
  if (!table_) return;
  const std::uint64_t before = table_->rows();
  try {
    table_->flush();
  } catch (const Error& error) {
    const std::uint64_t lost = table_->give_up();
    frames_ -= before - table_->rows();
    lose(lost, error.what());
    return;
  }
  const std::uint64_t written = table_->rows() - before;
  frames_ += written;
  if (written == 0 || waits_) return;
  {
    const std::scoped_lock lock(mutex_);
    if (fault_.empty()) return;
    fault_.clear();
  }
  say_("frames are written again, into " + table_->file() + "; " + grouped(lost_) +
       " frames are in no table");
}

// Says so once, until frames are written again.
void FrameLog::lose(std::uint64_t frames, const std::string& why) {
  lost_ += frames;
  const std::string sentence = "frames are not written: " + why;
  {
    const std::scoped_lock lock(mutex_);
    if (!std::exchange(fault_, sentence).empty()) return;
  }
  say_(sentence);
}

void FrameLog::say_what_was_dropped() {
  std::uint64_t dropped = 0;
  {
    const std::scoped_lock lock(mutex_);
    dropped = std::exchange(dropped_, 0);
  }
  if (dropped == 0) return;
  lost_ += dropped;
  say_("the disk is too slow; " + grouped(lost_) + " frames are in no table so far");
}

void FrameLog::finish_table() {
  if (!table_ || checksum_.empty()) return;
  try {
    table_->write_checksum(checksum_);
  } catch (const Error& error) {
    lose(0, error.what());
  }
}

// Of a live source: no frame comes for this table any more, and its recording is over.
void FrameLog::end_table() {
  if (table_ != nullptr) checksums_->add(std::move(table_), facts_.recording);
}

std::string FrameLog::fault() const {
  const std::scoped_lock lock(mutex_);
  return fault_;
}

std::string FrameLog::summary() const {
  std::string text = grouped(frames_) + " frames in ";
  text += tables_ == 1 ? last_file_ : grouped(tables_) + " tables";
  return lost_ == 0 ? text : text + fmt::format("; {} frames are in no table", grouped(lost_));
}

}  // namespace splid::recording
