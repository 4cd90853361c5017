#include "daemon/recording/recording_tap.hpp"

#include <fmt/core.h>
#include <pthread.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <future>
#include <utility>

#include "daemon/base/text.hpp"
#include "daemon/recording/loss_words.hpp"
#include "daemon/recording/recording_facts.hpp"

namespace splid::recording {
namespace {

constexpr std::chrono::milliseconds tap_idle{100};
constexpr std::size_t tap_tags_at_once = 65'536;
constexpr std::size_t max_batches = 65'536;
constexpr std::size_t max_counts = 1 << 22;
constexpr std::size_t max_early_frames = 256;

// A service has to end at once. Short recordings are read in this time, and of long ones the log
// says that their tables lack the sum.
constexpr std::chrono::milliseconds patience_for_checksum{300};

// A killed daemon may lose half a second of tags; flushing a little more often leaves time for the
// write itself.
constexpr std::int64_t tap_flush_interval_ns = 400'000'000;

// The queue of encoder batches, as the encoder of one file.
class QueuedCounts final : public EncoderSource {
 public:
  explicit QueuedCounts(CountsQueue& queue) : queue_(queue) {}
  bool next(EncoderBatch& batch) override { return queue_.take(batch); }
  [[nodiscard]] bool live() const override { return true; }

 private:
  CountsQueue& queue_;
};

}  // namespace

void CountsQueue::put(const EncoderBatch& batch) {
  const std::scoped_lock lock(mutex_);
  if (batches_.size() >= max_batches || counts_ + batch.counts.size() > max_counts) {
    overrun_ = true;
    return;
  }
  counts_ += batch.counts.size();
  batches_.push_back(batch);
  batches_.back().overrun = batch.overrun || std::exchange(overrun_, false);
}

bool CountsQueue::take(EncoderBatch& batch) {
  const std::scoped_lock lock(mutex_);
  if (batches_.empty()) return false;
  batch = std::move(batches_[first_++]);
  if (first_ < batches_.size()) return true;
  batches_.clear();
  first_ = counts_ = 0;
  return true;
}

Tap::Tap(const Config& config, const SourceInfo& source, const Clock& clock,
         std::function<void(const std::string&)> say)
    : clock_(clock),
      say_(std::move(say)),
      waits_(!source.live),
      ring_(std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags))),
      dropping_(ring_, {}),
      writer_(
          {config.record, config.channels, source, header_facts(config, source, "")}, clock,
          [this] { return open_counts(); },
          [this](const std::string& sentence) { news_.push_back(sentence); }),
      tables_(config.record.frames),
      frames_(tables_ == RecordFrames::off
                  ? nullptr
                  : std::make_unique<FrameLog>(
                        table_facts(config, ""),
                        [this](const std::string& sentence) { tell(sentence); })),
      thread_([this] { run(); }) {}

Tap::~Tap() { finish(); }

void Tap::take(std::span<const Tag> tags) {
  while (!tags.empty()) {
    if (not_awaited_ > 0) return lose(tags);
    const std::span<Tag> room =
        waits_ ? ring_.wait_claim(tags.size(), hurried_.get_token()) : dropping_.claim(tags.size());
    if (room.empty()) return lose(tags);
    std::copy_n(tags.begin(), room.size(), room.begin());
    if (waits_) {
      ring_.publish(room.size());
    } else {
      dropping_.publish(room.size());
    }
    tags = tags.subspan(room.size());
  }
}

void Tap::lose(std::span<const Tag> tags) {
  const auto events =
      std::count_if(tags.begin(), tags.end(), [](const Tag& tag) { return is_event(tag.kind); });
  not_awaited_ += static_cast<std::uint64_t>(events);
}

void Tap::tell(const std::string& sentence) {
  const std::scoped_lock lock(say_mutex_);
  if (say_) say_(sentence);
}

// The first frames may come before the recorder has made its first file.
void Tap::take_frame(const FrameMessage& frame) {
  if (!frames_) return;
  early_.push_back(frame);
  if (early_.size() >= max_early_frames || !file().empty()) put_frames();
}

void Tap::put_frames() {
  const std::string recording = file();
  const std::string table = recording.empty() ? "" : table_beside(recording, tables_);
  for (const FrameMessage& frame : early_) frames_->put(frame, table, recording);
  early_.clear();
}

std::unique_ptr<EncoderSource> Tap::open_counts() {
  if (!has_counts_) return nullptr;
  return std::make_unique<QueuedCounts>(counts_);
}

void Tap::finish() {
  if (std::exchange(finished_, true)) return;
  if (waits_) {
    ring_.close();
  } else {
    dropping_.finish();
  }
}

void Tap::run() {
  pthread_setname_np(pthread_self(), "recorder");
  flushed_ns_ = clock_.steady_ns();
  while (!ring_.ended()) {
    const std::span<const Tag> waiting = ring_.wait(tap_idle, {});
    const auto tags = waiting.first(std::min(waiting.size(), tap_tags_at_once));
    unflushed_ += tags.size();
    writer_.take(tags);
    ring_.consume(tags.size());
    look_around();
  }
  writer_.close();
  look_around();
}

void Tap::look_around() {
  const std::int64_t now_ns = clock_.steady_ns();
  if (now_ns - flushed_ns_ > tap_flush_interval_ns) {
    writer_.flush();
    unflushed_ = 0;
    flushed_ns_ = now_ns;
    const std::uint64_t drops = dropping_.drops();
    if (std::exchange(said_drops_, drops) != drops) {
      news_.push_back("the disk is too slow; " + grouped(dropping_.dropped_tags()) +
                      " tags lost so far");
    }
  }
  {
    const std::scoped_lock lock(mutex_);
    if (fault_ != writer_.fault()) fault_ = writer_.fault();
    if (status_.file != writer_.file()) status_.file = writer_.file();
    status_.bytes = writer_.file_bytes();
    status_.seconds = writer_.file_seconds();
    status_.state = !fault_.empty()        ? RecordingState::failing
                    : status_.file.empty() ? RecordingState::waiting
                                           : RecordingState::writing;
  }
  // After fault_ is set, so that whoever hears a sentence finds the fault in fault().
  for (const std::string& sentence : news_) tell(sentence);
  news_.clear();
}

std::string Tap::fault() const {
  {
    const std::scoped_lock lock(mutex_);
    if (!fault_.empty() || !frames_) return fault_;
  }
  return frames_->fault();
}

std::string Tap::file() const {
  const std::scoped_lock lock(mutex_);
  return status_.file;
}

RecordingStatus Tap::status() const {
  const std::scoped_lock lock(mutex_);
  return status_;
}

std::string Tap::summary() {
  finish();
  if (thread_.joinable()) thread_.join();
  std::string text =
      fmt::format("{} recordings; {} tags lost to the disk", grouped(writer_.files()),
                  grouped(writer_.lost_tags() + dropping_.dropped_tags() + not_awaited_));
  if (writer_.rejected() > 0) text += "; " + grouped(writer_.rejected()) + " tags fit no record";
  if (writer_.strays() > 0) text += "; " + grouped(writer_.strays()) + strays_in_words;
  if (!frames_) return text;
  put_frames();
  frames_->finish({}, patience_for_checksum);
  return text + "; " + frames_->summary();
}

// The tags that the recorder has just taken are in the ring as well until it is done with them.
std::string Tap::give_up() {
  {
    const std::scoped_lock lock(say_mutex_);
    say_ = nullptr;
  }
  const std::uint64_t left = ring_.fill() + unflushed_ + dropping_.dropped_tags() + not_awaited_;
  const std::string name = file();
  return (name.empty() ? "the recording" : name) + ": the disk does not take what is left; up to " +
         grouped(left) + " tags are lost";
}

Ended end_within(std::unique_ptr<Tap> tap, std::chrono::milliseconds patience) {
  std::shared_ptr<Tap> shared = std::move(tap);
  std::promise<Ended> promise;
  std::future<Ended> ended = promise.get_future();
  std::thread([tap = shared, promise = std::move(promise)]() mutable {
    pthread_setname_np(pthread_self(), "recording-end");
    std::string text = tap->summary();
    Ended all{true, std::move(text), tap->file()};
    tap.reset();
    promise.set_value(std::move(all));
  }).detach();
  if (ended.wait_for(patience) == std::future_status::ready) return ended.get();
  return {false, shared->give_up(), shared->file()};
}

}  // namespace splid::recording
