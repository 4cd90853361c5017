#include "daemon/service/measured_copy.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <utility>

#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/recording/recording_facts.hpp"

namespace splid {
namespace {

constexpr std::chrono::milliseconds copy_idle{100};
constexpr std::size_t copied_at_once = 65'536;

// What a ring holds, as the source of a stream.
class RingSource final : public TagSource {
 public:
  RingSource(TagRing& ring, SourceInfo info) : ring_(ring), info_(std::move(info)) {}
  [[nodiscard]] SourceInfo info() const override { return info_; }
  void run(TagSink& sink, std::stop_token stop) override {
    while (!ring_.ended() && !stop.stop_requested()) {
      const std::span<const Tag> waiting = ring_.wait(copy_idle, stop);
      const auto tags = waiting.first(std::min(waiting.size(), copied_at_once));
      if (tags.empty()) {
        sink.publish(0);
        continue;
      }
      const std::span<Tag> room = sink.claim(tags.size());
      std::copy_n(tags.begin(), room.size(), room.begin());
      sink.publish(room.size());
      ring_.consume(room.size());
    }
  }

 private:
  TagRing& ring_;
  SourceInfo info_;
};

}  // namespace

MeasuredCopy::MeasuredCopy(const Config& config, const SourceInfo& source,
                           const std::string& recording)
    : recording_(recording),
      table_(recording::table_beside(recording, config.record.frames)),
      waits_(!source.live),
      ring_(std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags))),
      dropping_(ring_, {}),
      stream_(stream_options(config), std::make_unique<RingSource>(ring_, source), host_clock()),
      frames_(recording::table_facts(config, recording),
              [](const std::string& sentence) { log_warning(sentence); }),
      thread_([this, &config] { publish(config); }) {}

MeasuredCopy::~MeasuredCopy() {
  stream_.request_stop();
  close();
}

void MeasuredCopy::take(std::span<const Tag> tags) {
  while (!tags.empty()) {
    const std::span<Tag> room =
        waits_ ? ring_.wait_claim(tags.size(), over_.get_token()) : dropping_.claim(tags.size());
    if (room.empty()) return;
    std::copy_n(tags.begin(), room.size(), room.begin());
    if (waits_) {
      ring_.publish(room.size());
    } else {
      dropping_.publish(room.size());
    }
    tags = tags.subspan(room.size());
  }
}

void MeasuredCopy::close() {
  if (std::exchange(closed_, true)) return;
  if (waits_) {
    ring_.close();
  } else {
    dropping_.finish();
  }
}

// Nobody can subscribe: the frames go to the table alone.
void MeasuredCopy::publish(const Config& config) {
  try {
    Publisher nowhere("", 1);
    OutputOptions options = output_options(config);
    options.encoder = {};
    options.source = nullptr;
    const bool has_pixels = config.pixels.size() > 1;
    const auto keep = [&](const FrameMessage& message, const std::string&) {
      if (!has_pixels) frames_.put(message, table_, recording_);
      return true;
    };
    const auto keep_pixel = [&](const SceneMessage::Pixel& pixel) {
      frames_.put(pixel.frame, table_, recording_);
    };
    Output output(std::move(options), {nowhere, nullptr, nullptr, keep, keep_pixel}, host_clock());
    output.begin();
    const StreamSummary summary = output.publish(stream_);
    fault_ = summary.fault;
  } catch (...) {
    fault_ = std::current_exception();
  }
  over_.request_stop();
}

std::string MeasuredCopy::finish(const std::stop_token& stop) {
  close();
  thread_.join();
  frames_.finish(stop);
  if (fault_) std::rethrow_exception(fault_);
  const std::uint64_t dropped = dropping_.dropped_tags();
  std::string text = frames_.summary();
  return dropped == 0 ? text : text + fmt::format("; {} tags lost to them", grouped(dropped));
}

}  // namespace splid
