#include "daemon/stream/encoder_feed.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/base/log.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr double most_patience_ns = 40e6;
constexpr std::int64_t silence_ns = 1'000'000'000;

// The most that is taken at one look, about a millisecond's work: a bridge that floods must not
// hold a frame. An encoder of 100 kHz makes 5000 counts a frame.
constexpr std::size_t most_batches_at_once = 4096;
constexpr std::size_t most_counts_at_once = 1 << 16;

// The wait is shorter than a frame, since late counts would otherwise hold one frame after another
// back.
std::int64_t patience_ns(const Frame& frame) {
  constexpr double ns_per_ps = 1e-3;
  const double length_ns = static_cast<double>(frame.end_ps - frame.start_ps) * ns_per_ps;
  return static_cast<std::int64_t>(std::min(most_patience_ns, 0.8 * length_ns));
}

}  // namespace

EncoderFeed::EncoderFeed(std::unique_ptr<EncoderSource> source, const EncoderOptions& options,
                         const Clock& clock)
    : source_(std::move(source)),
      clock_(clock),
      join_({options.m_per_count, options.offset_m}, source_->live()) {}

std::optional<FrameMessage::Reference> EncoderFeed::reference(const Frame& frame) {
  if (failed_) return std::nullopt;
  std::vector<std::int64_t> markers_ps;
  markers_ps.reserve(frame.markers.size());
  for (const MarkerTag& marker : frame.markers.view()) markers_ps.push_back(marker.time_ps);
  join_.take_frame(frame.start_ps, frame.end_ps, markers_ps, frame.losses.view());
  take_counts();
  while (source_->live() && join_.waits() && clock_.steady_ns() - heard_ns_ < silence_ns &&
         clock_.steady_ns() - frame.arrival_ns < patience_ns(frame)) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
    take_counts();
  }
  say_fault();
  const std::optional<EncoderPosition> position = join_.position();
  if (!position) return std::nullopt;
  return FrameMessage::Reference{position->distance_m, position->velocity_mps};
}

void EncoderFeed::take_counts() {
  std::size_t batches = 0;
  std::size_t counts = 0;
  try {
    while (source_->live() ? batches++ < most_batches_at_once && counts < most_counts_at_once
                           : join_.waits()) {
      if (!source_->next(batch_)) break;
      counts += batch_.counts.size();
      join_.take_counts(batch_);
      observer_(batch_);
      heard_ns_ = clock_.steady_ns();
    }
  } catch (const Error& error) {
    failed_ = true;
    log_warning("no reference: {}", error.what());
  }
}

void EncoderFeed::say_fault() {
  std::string fault = join_.fault();
  if (fault == said_) return;
  if (!fault.empty()) log_warning("no reference: {}", fault);
  said_ = std::move(fault);
}

}  // namespace splid
