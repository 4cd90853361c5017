#include "daemon/output/fold_feed.hpp"

#include <pthread.h>

#include <utility>

#include "daemon/base/log.hpp"
#include "daemon/output/frame_fold.hpp"
#include "protocol/error.hpp"

namespace splid {

FoldOptions fold_options(const Config& config) {
  return {config.pattern, config.pulse, config.drift.reference};
}

FoldFeed::FoldFeed(FoldOptions options, Publisher& publisher, const Clock& clock)
    : publisher_(publisher), clock_(clock), options_(std::move(options)) {}

FoldFeed::~FoldFeed() = default;

void FoldFeed::frame_published(const Frame& frame, const Estimate& estimate,
                               const FrameMessage& message, const std::string& pixel) {
  if (!publisher_.fold_is_wanted()) return;
  const std::int64_t now_ns = clock_.steady_ns();
  if (taken_ns_ && now_ns - *taken_ns_ < between_ns) return;
  {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || is_waiting_) return;
    take(frame, estimate, message);
    job_.message.pixel = pixel;
    is_waiting_ = true;
  }
  taken_ns_ = now_ns;
  wake_.notify_one();
  if (thread_.joinable()) return;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void FoldFeed::reload(const PulseOptions& pulse) {
  const std::scoped_lock lock(mutex_);
  options_.pulse = pulse;
  is_changed_ = true;
}

void FoldFeed::take(const Frame& frame, const Estimate& estimate, const FrameMessage& message) {
  const FrameView view = frame.view();
  job_.estimate = estimate;
  job_.start_ps = view.start_ps;
  job_.end_ps = view.end_ps;
  job_.sync = view.sync;
  job_.losses.assign(view.losses.begin(), view.losses.end());
  job_.photons_ps.clear();
  const std::size_t step = 1 + view.photons_ps.size() / most_photons;
  for (std::size_t i = 0; i < view.photons_ps.size(); i += step) {
    job_.photons_ps.push_back(view.photons_ps[i]);
  }
  job_.message = {message.timestamp_s,    message.sequence,       message.status,
                  view.photons_ps.size(), job_.photons_ps.size(), {}};
}

void FoldFeed::make_pictures() {
  is_changed_ = false;
  pictures_.reset();
  try {
    pictures_ = std::make_unique<FrameFold>(options_.pattern, options_.pulse, options_.reference);
  } catch (const Error& error) {
    // Nor is there an estimator with these options, so that a stream does not begin with them.
    log_warning("no pictures of the photons: {}", error.what());
  }
}

void FoldFeed::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "fold");
  while (true) {
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [this] { return is_waiting_; })) return;
      if (is_changed_) make_pictures();
    }
    if (pictures_) {
      const FrameView view{job_.start_ps, job_.end_ps, job_.photons_ps, job_.losses, job_.sync};
      job_.message.fold = pictures_->fold(view, job_.estimate);
    }
    publisher_.publish_fold(to_json(job_.message));
    const std::scoped_lock lock(mutex_);
    is_waiting_ = false;
  }
}

}  // namespace splid
