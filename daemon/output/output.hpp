#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/device_monitor.hpp"
#include "daemon/output/fold_feed.hpp"
#include "daemon/output/liveness.hpp"
#include "daemon/output/metrics.hpp"
#include "daemon/output/pixel_watch.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/output/scan_watch.hpp"
#include "daemon/output/service_notifier.hpp"
#include "daemon/output/status_reporter.hpp"
#include "daemon/output/stream_summary.hpp"
#include "daemon/recording/recording_tap.hpp"
#include "daemon/stream/encoder_feed.hpp"
#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/scene_message.hpp"
#include "daemon/stream/stream.hpp"
#include "estimator/checks/detector_watch.hpp"

// This room publishes the results of the streams. Read this header first, then frame_message.hpp
// (the message of a frame) and status_reporter.hpp (the status of the daemon).

namespace splid {

// Hears each frame as it is published: the message and the very JSON that subscribers get; of
// several pixels what they share, and the JSON of the scene. Returns false to end the stream.
using FrameObserver = std::function<bool(const FrameMessage&, const std::string& json)>;

// Hears the frame of each pixel, where there are several, before the observer hears of the scene.
using PixelObserver = std::function<void(const SceneMessage::Pixel&)>;

// What the output needs to know of the configuration.
struct OutputOptions {
  FrameContext context;
  StatusOptions status;
  EncoderOptions encoder;
  const SourceOptions* source = nullptr;  // whose scene may have the encoder; outlives the output
  FoldOptions fold;
  DetectorOptions detector;
  std::size_t inputs = 1;                // of the detector
  std::optional<SceneMaker> scene = {};  // where there are several pixels
};

OutputOptions output_options(const Config& config);

// Everything that a run says, from its begin to its end: frames and states to subscribers, metrics,
// the watchdog's food, the encoder's reference and the observer. Streams come and go below it;
// frames are numbered, and everything is counted, as if there were one stream.
//
// Threads: record() and reload() may be called from any thread, everything else from the thread
// that made the output. Errors: publish() throws what the observer threw, after the stream has
// ended.
class Output {
 public:
  // Where the output goes to. All of them outlive the output; metrics and device are null where
  // there are none.
  struct Ends {
    Publisher& publisher;
    DeviceMonitor* device = nullptr;  // what the driver reports goes into the status
    Metrics* metrics = nullptr;
    FrameObserver observer = nullptr;
    PixelObserver pixel_observer = nullptr;
  };

  // clock: outlives this.
  Output(OutputOptions options, Ends ends, const Clock& clock);
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  // Opens the encoder, where the configuration has one, for the stream that is published next.
  // Errors: those of open_encoder().
  void begin();
  // Starts the stream, publishes its frames until it has ended or the observer has enough, and
  // returns what came of it. After begin().
  StreamSummary publish(Stream& stream);

  // While there is no stream: subscribers hear why, the watchdog is fed and the metrics stand
  // still. To be called at least every 100 ms. reason: a sentence.
  void wait(const std::string& reason);
  // The run is over. reason: why; empty where nothing is wrong.
  void stop(const std::string& reason);

  // From now on the status tells the faults of `recording`, which is given the frames and the
  // encoder's counts;
  // null: there is no recording.
  void record(recording::Tap* recording);
  // Messages from now on follow these options, which differ from those of the constructor in what
  // can change while frames flow (with_live()). Errors: those of DetectorWatch; nothing has
  // changed then.
  void reload(const OutputOptions& next);

 private:
  void publish_unit(const EstimationUnit& unit, StreamSummary& summary);
  void publish_frame(const EstimationUnit& unit, StreamSummary& summary);
  void publish_scene(const EstimationUnit& unit, StreamSummary& summary);
  void publish_pixels(const EstimationUnit& unit, const SceneMessage& scene);
  void count(const FrameMessage& message, const EstimationUnit& unit, const FoundList& recent,
             StreamSummary& summary);
  [[nodiscard]] double latency_ms(const Frame& frame) const;
  [[nodiscard]] const std::vector<bool>& pixels_asked_for(const SceneMessage& scene);
  void tell_observer(const FrameMessage& message, const std::string& json);
  void tell_observer(const SceneMessage::Pixel& pixel);
  void look_around(Stream& stream);
  [[nodiscard]] StreamHealth health(Stream& stream);
  [[nodiscard]] StreamCounters all_counters(const Stream& stream) const;
  void end(Stream& stream, StreamSummary& summary);
  void take_reloaded();
  void give_counts(const EncoderBatch& batch);
  void give_frame(const FrameMessage& message);

  const OutputOptions options_;
  Ends ends_;
  const Clock& clock_;
  StatusReporter reporter_;
  ServiceNotifier notifier_;
  StreamCounters before_;  // of the streams that have ended
  FrameContext context_;
  std::optional<SceneMaker> scene_;  // where there are several pixels
  PixelWatch pixels_;
  std::uint64_t pixel_topics_known_ = 0;
  std::vector<bool> pixels_asked_for_;
  FoldFeed fold_;
  checks::DetectorWatch detector_;
  bool walk_said_ = false;  // of this stream, in the log
  // The rest concerns the stream that is published.
  Liveness liveness_;
  std::optional<EncoderFeed> encoder_;
  std::atomic<bool> has_encoder_{false};
  std::string sync_fault_;  // a sentence; empty: none found
  ScanWatch scan_watch_;
  bool scan_is_faulty_ = false;
  double last_fill_ = 0;      // of the ring, when the stream ended
  std::uint64_t beyond_ = 0;  // FramerTotals::beyond as last seen
  std::int64_t beyond_until_ns_ = 0;
  bool observer_done_ = false;
  std::exception_ptr observer_fault_;

  std::mutex recording_mutex_;           // the framer never takes it
  recording::Tap* recording_ = nullptr;  // under recording_mutex_
  std::mutex reload_mutex_;
  std::optional<FrameContext> reloaded_context_;            // under reload_mutex_
  std::optional<SceneMaker> reloaded_scene_;                // under reload_mutex_
  StatusOptions reloaded_status_;                           // under reload_mutex_
  std::optional<checks::DetectorWatch> reloaded_detector_;  // under reload_mutex_
};

}  // namespace splid
