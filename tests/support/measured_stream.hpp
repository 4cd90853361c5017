#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <utility>

#include "daemon/output/output.hpp"
#include "daemon/recording/recording_tap.hpp"
#include "daemon/stream/stream.hpp"

namespace splid::test {

// One stream from its source to its output, as `run` measures it, without a service around it.
class MeasuredStream {
 public:
  // All but source outlive this.
  MeasuredStream(const Config& config, std::unique_ptr<TagSource> source, Publisher& publisher,
                 const Clock& clock, Metrics* metrics = nullptr)
      : stream_(stream_options(config), std::move(source), clock),
        output_(output_options(config),
                {publisher, nullptr, metrics,
                 [this](const FrameMessage& frame, const std::string& json) {
                   return !observer_ || observer_(frame, json);
                 }},
                clock) {
    output_.begin();
  }

  void observe(FrameObserver observer) { observer_ = std::move(observer); }
  // As Measuring begins and ends a recording; from any thread.
  void record(recording::Tap* recording) {
    output_.record(recording);
    stream_.tap_into(recording);
  }
  void reload(const Config& next) {
    stream_.reload(stream_.maker(stream_options(next))({}));
    output_.reload(output_options(next));
  }
  StreamSummary run(const std::stop_token& stop) {
    const std::stop_callback pass_on(stop, [this] { stream_.request_stop(); });
    const StreamSummary summary = output_.publish(stream_);
    output_.stop("");
    return summary;
  }

 private:
  FrameObserver observer_;
  Stream stream_;
  Output output_;
};

}  // namespace splid::test
