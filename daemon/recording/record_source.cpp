#include "daemon/recording/record_source.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/recording/encoder_log.hpp"
#include "daemon/recording/loss_words.hpp"
#include "daemon/recording/ptu_writer.hpp"
#include "daemon/recording/recording_facts.hpp"
#include "daemon/recording/stray_times.hpp"
#include "daemon/stream/device_clock.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/source_thread.hpp"
#include "protocol/error.hpp"

namespace splid::recording {
namespace {

constexpr std::chrono::milliseconds idle{100};
constexpr std::size_t tags_at_once = 65'536;

// A killed process may lose half a second of tags; flushing a little more often leaves time for
// the write itself.
constexpr std::int64_t flush_interval_ns = 400'000'000;

// A source that is still connecting, or that buffers its tags, may be this late.
constexpr double patience_s = 5;

// The first and the last time of a stream, which give its length.
struct Extent {
  std::optional<std::int64_t> first_ps;
  std::int64_t last_ps = 0;

  void take(std::span<const Tag> tags) {
    if (tags.empty()) return;
    if (!first_ps) first_ps = tags.front().time_ps;
    last_ps = tags.back().time_ps;
  }
  [[nodiscard]] double seconds() const {
    return first_ps ? static_cast<double>(last_ps - *first_ps) / 1e12 : 0;
  }
};

void check_enough(const SourceInfo& source, double seconds, double wanted_s,
                  const std::stop_token& stop) {
  if (!source.live || seconds >= wanted_s || stop.stop_requested()) return;
  throw Error(Fault::device, fmt::format("{} sent {:.3g} s of tags in {:.3g} s; is it running?",
                                         source.name, seconds, wanted_s + patience_s));
}

void show(Progress& progress, const PtuWriter& writer, double stream_s, double took_s) {
  const auto records = static_cast<double>(writer.records());
  progress.show(fmt::format("{} records, {:.3g} M/s, {:.1f} MB, {:.1f} s recorded, {} lost",
                            grouped(writer.records()), records / 1e6 / std::max(took_s, 1e-3),
                            static_cast<double>(writer.bytes()) / 1e6, stream_s,
                            grouped(writer.lost_tags())));
}

}  // namespace

RecordSummary record_source(const Config& config, TagSource& source, const std::string& file,
                            bool overwrite, const Clock& clock, const std::stop_token& stop,
                            const Limit& limit) {
  const SourceInfo info = source.info();
  std::unique_ptr<EncoderSource> counts = open_encoder(config.encoder, config.source.get());
  if (counts) check_may_write(encoder_file_of(file), overwrite);
  PtuWriter writer(file, header_facts(config, info, counts ? encoder_file_of(file) : ""),
                   DeviceClock(info, clock), overwrite);
  std::optional<EncoderLog> encoder;
  if (counts) encoder.emplace(file, std::move(counts), ChannelMap(config.channels));
  TagRing ring(std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags)));
  std::stop_source enough;
  const std::stop_callback pass_on(stop, [&enough] { enough.request_stop(); });
  SourceThread thread(source, ring, enough.get_token());
  Progress progress(clock);
  Extent extent;
  StrayTimes stray_times;
  const auto keep = [&](std::span<const Tag> tags) {
    extent.take(tags);
    writer.write(tags);
    if (encoder) encoder->write(tags);
  };
  const std::int64_t begin_ns = clock.steady_ns();
  std::int64_t flushed_ns = begin_ns;
  while (!ring.ended()) {
    const std::span<const Tag> waiting = ring.wait(idle, {});
    const auto tags = waiting.first(std::min(waiting.size(), tags_at_once));
    keep(stray_times.sort_out(tags));
    limit.see(tags);
    ring.consume(tags.size());
    const std::int64_t now_ns = clock.steady_ns();
    if (now_ns - flushed_ns > flush_interval_ns) {
      writer.flush();
      if (encoder) encoder->flush();
      limit.progress(extent.seconds());
      flushed_ns = now_ns;
    }
    const double took_s = static_cast<double>(now_ns - begin_ns) / 1e9;
    const bool is_late = info.live && took_s > limit.seconds + patience_s;
    if (limit.seconds > 0 && (extent.seconds() >= limit.seconds || is_late)) enough.request_stop();
    if (progress.due()) show(progress, writer, extent.seconds(), took_s);
  }
  keep(stray_times.finish());
  writer.close();
  if (encoder) {
    encoder->write({});  // the counts that came meanwhile
    encoder->flush();
  }
  thread.join();
  if (thread.fault()) std::rethrow_exception(thread.fault());
  check_enough(info, extent.seconds(), limit.seconds, stop);
  return {writer.records(), writer.lost_tags(), uncounted_losses(writer.losses()),
          writer.bytes(),   extent.seconds(),   stray_times.strays()};
}

std::string in_words(const RecordSummary& summary, const std::string& file) {
  std::string text = fmt::format("{} records ({} bytes, {:.6g} s) in {}, {}",
                                 grouped(summary.records), grouped(summary.bytes), summary.seconds,
                                 file, lost_in_words(summary.lost_tags, summary.uncounted_losses));
  if (summary.strays > 0) text += "; " + grouped(summary.strays) + strays_in_words;
  return text;
}

}  // namespace splid::recording
