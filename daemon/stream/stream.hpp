#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/stream/frame_dealer.hpp"
#include "daemon/stream/framer_thread.hpp"
#include "daemon/stream/lane.hpp"
#include "daemon/stream/lane_estimator.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/source_thread.hpp"
#include "daemon/stream/tag_tap.hpp"
#include "drivers/source.hpp"
#include "estimator/array/pixel_track.hpp"

// This room makes frames of tags. Read this header first, then framer.hpp (where
// a frame ends) and effort_governor.hpp (what happens when estimation is too slow).

namespace splid {

// What a stream is read, cut and estimated by.
struct StreamOptions {
  Pattern pattern;
  ChannelOptions channels;
  FrameOptions frame;
  ScanOptions scan;
  DriftOptions drift;
  PulseOptions pulse;
  SceneOptions scene;
  EstimatorOptions estimator;
  PipelineOptions pipeline;
  DetectorOptions detector;
  std::vector<PixelOptions> pixels;  // several, or none where there is one
  FrameChoice wanted = nullptr;      // null: all frames are estimated
};

StreamOptions stream_options(const Config& config);

// The options of a pixel: those of all, with its own detector and pulse.
StreamOptions options_of_pixel(const StreamOptions& options, const PixelOptions& pixel);

// The estimator that these options ask for; of several pixels, for none of them. Errors:
// Error(Fault::usage) where it refuses them.
FrameEstimator make_frame_estimator(const StreamOptions& options, std::size_t max_photons);

// How many estimators the threads of a stream have together: each has one for each kind of pixel
// that it estimates.
std::size_t estimators_needed(const StreamOptions& options);

// Throws what a stream's constructor would of these options, without making its buffers.
void check_stream(const StreamOptions& options);

// What a reload hands in: an estimator for each estimation thread, and what joins the pixels.
struct NewEstimators {
  std::vector<EstimatorInUse> each;
  Effort effort = Effort::balanced;  // configured
};

// Where every tag of a stream went, as its stages count it; no count ever falls.
struct StreamCounters {
  FramerTotals framer;
  std::uint64_t dropped_tags = 0;    // since the ring was full; the framer has them as reported
  std::uint64_t discarded_tags = 0;  // in the ring when a stop request's time was up
  std::vector<SourceCounter> source;
};

// Adds the counts of another stream from a source of the same kind.
StreamCounters& operator+=(StreamCounters& sum, const StreamCounters& more);

// From a source to estimated frames: source thread -> ring -> framer thread -> estimation threads
// -> whoever takes the frames. Frame k goes to estimation thread k mod N and is taken from there in
// the same order. Of several pixels, pixel p of every frame goes to estimation thread p mod N, and
// a frame is taken once all threads are done with it, and one more thread has joined its pixels,
// where the scene asks for that. So N changes neither the order of the frames nor a bit of them;
// but one pixel that is tracked is followed from the frame N before. docs/architecture.md has the
// threads on one page.
//
// Threads: made, started, read with next() and joined on one; each other function says who may call
// it. Errors: the constructor throws Error(Fault::usage) where a frame does not fit the ring or the
// estimator refuses the pattern. Timeouts: only wait(), join() and tap_into(nullptr) wait.
class Stream {
 public:
  // Tags that the ring still holds this long after a stop request become no frames, and frames that
  // no estimation has begun with are published as incomplete.
  static constexpr int stop_patience_ms = 400;

  // clock: outlives this.
  Stream(StreamOptions options, std::unique_ptr<TagSource> source, const Clock& clock);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  // Starts the threads. Once.
  void start();
  // Ends the source; the frames on their way still come. Any thread, at any time.
  void request_stop();

  // The next frame with its estimate; null where none is ready. Valid until release().
  [[nodiscard]] const EstimationUnit* next();
  // Gives the unit of next() back to the framer.
  void release();
  // Every frame was taken, and none comes any more.
  [[nodiscard]] bool ended() const;
  // Until a frame may be ready, somebody notifies wake(), or the time is over.
  void wait(std::chrono::milliseconds most) { wake_.wait_for(most); }
  // Wakes wait().
  [[nodiscard]] Wake& wake() { return wake_; }
  // After ended(): waits for the threads. What ended the source; null where its stream ended by
  // itself or was stopped.
  std::exception_ptr join();

  // Gives every tag from now on to `tap` too; null: to no tap. Once this returns, which takes 100
  // ms at most, the tap before it is not used any more. To be called before start() or while the
  // stream runs, from one thread at a time, which is not the thread that takes frames.
  void tap_into(TagTap* tap);
  // Makes estimators for the pulse, scene, estimator and detector of the options; the other options
  // are not looked at. It may take seconds, and may outlive the stream. Errors: Error(Fault::usage)
  // where the estimator refuses them, and after a stop request.
  using Make = std::function<NewEstimators(const std::stop_token& stop)>;
  [[nodiscard]] Make maker(const StreamOptions& next) const;
  // Frames from now on are estimated by these, which a maker() of this stream has made. Any thread,
  // while the stream runs.
  void reload(NewEstimators made);

  [[nodiscard]] SourceInfo info() const { return source_->info(); }
  // Any thread.
  [[nodiscard]] StreamCounters counters() const;
  // When the last tag or heartbeat came, steady clock; 0: none yet. Any thread.
  [[nodiscard]] std::int64_t last_arrival_ns() const { return framer_.last_arrival_ns(); }
  // The highest fill of the ring since the last call, 0 to 1.
  [[nodiscard]] double take_highest_fill();
  // How often the source's thread came to the ring, and whether the ring is empty: what tells a
  // source that is silent from one that hangs.
  [[nodiscard]] std::uint64_t ring_touches() const { return ring_.touches(); }
  [[nodiscard]] bool ring_is_empty() const { return ring_.fill() == 0; }
  // Why no frame locks; null while nothing is found.
  [[nodiscard]] const SyncDiagnosis* diagnosis() const;

 private:
  [[nodiscard]] bool out_of_patience() const;
  void estimate(std::size_t index);
  void join_pixels();
  [[nodiscard]] std::size_t threads() const {
    return static_cast<std::size_t>(options_.pipeline.estimation_threads);
  }
  void estimate(EstimationUnit& unit, std::size_t index, std::vector<array::PixelTrack>& tracks);

  const StreamOptions options_;
  std::unique_ptr<TagSource> source_;
  const Clock& clock_;
  TagRing ring_;
  std::size_t max_photons_ = 0;  // that the estimator has room for
  Lanes lanes_;
  std::vector<std::unique_ptr<LaneEstimator>> estimators_;
  FrameDealer dealer_;
  FramerThread framer_;
  std::mutex reload_mutex_;
  Wake wake_;             // a frame was estimated
  std::size_t next_ = 0;  // lane of the next frame
  std::stop_source stop_;
  std::atomic<std::int64_t> stopped_ns_{0};  // when a stop was requested; 0: not yet
  std::vector<std::jthread> threads_;
  std::optional<SourceThread> source_thread_;  // from start() on
};

}  // namespace splid
