#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/stream/lane.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/options.hpp"
#include "protocol/fold_json.hpp"
#include "protocol/frame_json.hpp"

namespace splid {

class FrameFold;

// What the pictures are made by.
struct FoldOptions {
  Pattern pattern;
  PulseOptions pulse;
  ClockReference reference = ClockReference::tagger;
};

FoldOptions fold_options(const Config& config);

// Publishes the topic `fold`: pictures of the photons of one frame, at most once a second and only
// while somebody subscribes to it.
//
// A thread of its own, which the first subscriber has made, draws. The thread that publishes frames
// copies a frame's photons for it once the frame is out, and only if the thread has nothing to do;
// of more than most_photons every n-th. Without a subscriber, a frame costs one look at an atomic.
//
// Threads: one calls everything, that which publishes frames; the thread `fold` is this object's.
// Errors: none. Timeouts: no call waits but the destructor, for a frame that is being drawn.
class FoldFeed {
 public:
  static constexpr std::int64_t between_ns = 1'000'000'000;
  static constexpr std::size_t most_photons = std::size_t{1} << 18;

  // publisher and clock outlive this.
  FoldFeed(FoldOptions options, Publisher& publisher, const Clock& clock);
  ~FoldFeed();
  FoldFeed(const FoldFeed&) = delete;
  FoldFeed& operator=(const FoldFeed&) = delete;

  // A frame that was published; nothing of it is used after the return.
  // pixel: whose it is; empty where there is one.
  void frame_published(const Frame& frame, const Estimate& estimate, const FrameMessage& message,
                       const std::string& pixel = "");
  // Frames from now on have another pulse. Any thread.
  void reload(const PulseOptions& pulse);

 private:
  // A frame to draw.
  struct Job {
    FoldMessage message;
    Estimate estimate;
    std::int64_t start_ps = 0, end_ps = 0;
    SyncFit sync;
    std::vector<std::int64_t> photons_ps;
    std::vector<Loss> losses;
  };
  void take(const Frame& frame, const Estimate& estimate, const FrameMessage& message);
  void run(const std::stop_token& stop);
  void make_pictures();

  Publisher& publisher_;
  const Clock& clock_;
  std::optional<std::int64_t> taken_ns_;  // when a frame was last taken
  std::mutex mutex_;
  std::condition_variable_any wake_;
  // Under mutex_. is_changed_: options_ are others than those of pictures_. is_waiting_: job_ is to
  // be drawn, and the thread's alone until it is.
  FoldOptions options_;
  bool is_changed_ = true;
  bool is_waiting_ = false;
  Job job_;
  std::unique_ptr<FrameFold> pictures_;  // the thread's; null: not with these options
  std::jthread thread_;
};

}  // namespace splid
