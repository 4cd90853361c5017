#pragma once

#include <array>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/device_monitor.hpp"
#include "daemon/output/metrics.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/output/service_notifier.hpp"
#include "daemon/recording/recording_tap.hpp"
#include "daemon/stream/framer.hpp"
#include "drivers/source.hpp"
#include "protocol/messages.hpp"

namespace splid {

// What a stream came to.
struct PipelineSummary {
  std::array<std::uint64_t, 7> frames_by_status{};  // index: FrameStatus
  std::uint64_t frames = 0;
  std::uint64_t valid_frames = 0;
  std::uint64_t contradicted_frames = 0;            // their photons contradict the pattern
  PatternFault pattern_fault = PatternFault::none;  // of the last such
  double computed_ms = 0;  // estimation of all frames together, and how long they last
  double lasted_ms = 0;
  std::uint64_t locked_frames = 0;  // syncs gave the pattern's clock
  FramerTotals tags;
  std::uint64_t lost_tags = 0;       // known count, of all frames
  std::uint64_t discarded_tags = 0;  // in the ring when a stop request's time was up
  std::optional<SyncDiagnosis> diagnosis;
  std::exception_ptr fault;  // of the source; null where the stream ended or was stopped
  bool paused = false;       // by pause(), and for no other reason
};

// What came of all streams up to now, where one follows the other to the same subscribers.
struct StreamSoFar {
  StatusMessage status;  // as last published
  StreamTotals totals;
  std::vector<SourceCounter> counters;
};

// Hears each frame as it is published: the message and the very JSON that subscribers get. Returns
// false to end the stream.
using FrameObserver = std::function<bool(const FrameMessage&, const std::string& json)>;

// From source to subscribers: source thread -> ring -> framer thread -> estimation threads ->
// the caller's thread, which publishes. docs/threads.md has it on one page.
//
// Frame k goes to estimation thread k mod N and is taken from there in the same order, so that
// frames are published in order and N changes no bit of them.
//
// Threads: made and run on one. Errors: the constructor throws Error(Fault::usage) where a frame
// does not fit the ring or the estimator refuses the pattern.
class Pipeline {
 public:
  // All but source outlive this.
  Pipeline(const Config& config, std::unique_ptr<TagSource> source, Publisher& publisher,
           const Clock& clock);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  void observe(FrameObserver observer);
  // What the source reports goes into the status. device: outlives run().
  void watch(DeviceMonitor& device);
  // Where what is measured from is kept from now on; null: nowhere. Nothing of this uses the one
  // before once it returns, which takes 100 ms at most. Any thread but run()'s, one at a time;
  // before run(), or while it runs.
  void record(RecordingTap* recording);
  // Frames and counts go on from those of the streams before. Before run().
  void go_on_from(const StreamSoFar& before);
  // After run().
  [[nodiscard]] StreamSoFar so_far() const;
  // Who is told that the daemon works. notifier: outlives run().
  void serve(ServiceNotifier& notifier);
  // Who counts. metrics: outlives run().
  void measure(Metrics& metrics);
  // Frames from now on are estimated as this configuration says, in what can change while frames
  // flow (see ConfigChanges::live); the rest of it is not looked at. Any thread, while run() runs.
  // Errors: Error(Fault::usage) where the estimator refuses it; nothing has changed then.
  void reload(const Config& config);

  // Runs until the stream ends or a stop is requested; then what the ring holds still becomes
  // frames, for at most stop_patience_ms, and everything is published. Once.
  PipelineSummary run(const std::stop_token& stop);

  // Ends run() like a stop request, but says to subscribers nothing of an end: another stream
  // follows. Any thread.
  void pause();

  static constexpr int stop_patience_ms = 400;

 private:
  struct Stages;
  std::unique_ptr<Stages> stages_;
};

}  // namespace splid
