#include "daemon/stream/stream.hpp"

#include <pthread.h>

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "daemon/stream/frame_plan.hpp"
#include "estimator/frame_estimator.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

// How long an estimation thread sleeps before it looks again whether a frame has come.
constexpr std::chrono::milliseconds idle{100};

constexpr std::int64_t ns_in_ms = 1'000'000;

bool are_alike(const PixelOptions& one, const PixelOptions& other) {
  return one.sigma_ps == other.sigma_ps && one.dead_time_ns == other.dead_time_ns;
}

// The pixels of estimation thread `index` of `threads`, in order: every threads-th.
std::vector<PixelOptions> pixels_of_thread(const StreamOptions& options, std::size_t index,
                                           std::size_t threads) {
  if (options.pixels.empty()) return {PixelOptions{}};
  if (options.pixels.size() == 1) return options.pixels;
  std::vector<PixelOptions> pixels;
  for (std::size_t p = index; p < options.pixels.size(); p += threads) {
    pixels.push_back(options.pixels[p]);
  }
  return pixels;
}

// Pixels of which no two are alike: the first of each kind.
std::vector<PixelOptions> kinds_of(const std::vector<PixelOptions>& pixels) {
  std::vector<PixelOptions> kinds;
  for (const PixelOptions& pixel : pixels) {
    const auto is_like = [&](const PixelOptions& kind) { return are_alike(kind, pixel); };
    if (std::none_of(kinds.begin(), kinds.end(), is_like)) kinds.push_back(pixel);
  }
  return kinds;
}

EstimatorInUse make_estimators(const StreamOptions& options, std::size_t max_photons,
                               const std::vector<PixelOptions>& pixels) {
  EstimatorInUse made;
  made.tracked = options.estimator.tracked;
  made.helped = FieldEstimator::helps(options);
  const std::vector<PixelOptions> kinds = kinds_of(pixels);
  for (const PixelOptions& kind : kinds) {
    made.estimators.push_back(make_frame_estimator(options_of_pixel(options, kind), max_photons));
    if (options.pixels.size() > 1) made.estimators.back().leave_out_recent_findings();
  }
  for (const PixelOptions& pixel : pixels) {
    const auto same = std::find_if(kinds.begin(), kinds.end(), [&](const PixelOptions& kind) {
      return are_alike(kind, pixel);
    });
    made.of_pixel.push_back(static_cast<std::size_t>(same - kinds.begin()));
  }
  return made;
}

EstimatorInUse make_field(const StreamOptions& options, std::size_t max_photons) {
  EstimatorInUse made;
  if (FieldEstimator::is_wanted(options)) {
    made.field = std::make_unique<FieldEstimator>(options, max_photons);
  }
  return made;
}

std::size_t ring_capacity(const PipelineOptions& options) {
  return std::bit_ceil(static_cast<std::size_t>(options.ring_capacity_tags));
}

}  // namespace

StreamOptions stream_options(const Config& config) {
  return {config.pattern,  config.channels, config.frame,  config.scan,
          config.drift,    config.pulse,    config.scene,  config.estimator,
          config.pipeline, config.detector, config.pixels, nullptr};
}

FramerOptions framer_options_of(const StreamOptions& options, const SourceInfo& source) {
  FramerOptions made = framer_options(options.frame.length_ms, options.pattern,
                                      options.drift.method, options.detector.walk);
  made.scan = scan_lines(options.frame.by, options.scan, source.scan);
  return made;
}

StreamOptions options_of_pixel(const StreamOptions& options, const PixelOptions& pixel) {
  StreamOptions own = options;
  own.pulse.sigma_ps = pixel.sigma_ps.value_or(options.pulse.sigma_ps);
  own.detector.dead_time_ns = pixel.dead_time_ns.value_or(options.detector.dead_time_ns);
  return own;
}

FrameEstimator make_frame_estimator(const StreamOptions& options, std::size_t max_photons) {
  return {options.pattern,         options.pulse,           options.scene,
          options.estimator,       options.frame.length_ms, max_photons,
          options.drift.reference, options.detector,        options.channels.photon.size()};
}

std::size_t estimators_needed(const StreamOptions& options) {
  std::size_t count = 0;
  const auto threads = static_cast<std::size_t>(options.pipeline.estimation_threads);
  for (std::size_t i = 0; i < threads; ++i) {
    count += kinds_of(pixels_of_thread(options, i, threads)).size();
  }
  // A body's velocity is searched for, and then each pixel at rest.
  if (options.scene.rigid) count += 2;
  if (options.scene.pool) ++count;
  return count;
}

void check_stream(const StreamOptions& options) {
  check_frame_fits(options.frame.length_ms, options.pattern, ring_capacity(options.pipeline));
  (void)make_field(options, 1);
  (void)make_estimators(options, 1, pixels_of_thread(options, 0, 1));
}

StreamCounters& operator+=(StreamCounters& sum, const StreamCounters& more) {
  sum.framer += more.framer;
  sum.dropped_tags += more.dropped_tags;
  sum.discarded_tags += more.discarded_tags;
  if (sum.source.empty()) {
    sum.source = more.source;
    return sum;
  }
  for (std::size_t i = 0; i < std::min(sum.source.size(), more.source.size()); ++i) {
    sum.source[i].value += more.source[i].value;
  }
  return sum;
}

Stream::Stream(StreamOptions options, std::unique_ptr<TagSource> source, const Clock& clock)
    : options_(std::move(options)),
      source_(std::move(source)),
      clock_(clock),
      ring_(ring_capacity(options_.pipeline)),
      dealer_(source_->info(), options_.estimator.effort, clock, lanes_),
      framer_(framer_options_of(options_, source_->info()), ChannelMap(options_.channels), clock,
              ring_, dealer_) {
  const double length_ms = options_.frame.length_ms;
  check_frame_fits(length_ms, options_.pattern, ring_.capacity());
  dealer_.choose(options_.wanted);
  const FrameCapacity capacity = frame_capacity(length_ms, options_.pattern, ring_.capacity(),
                                                source_->info().live, options_.pixels.size());
  max_photons_ = std::min(capacity.photons, max_estimated_photons);
  const bool shares_frames = options_.pixels.size() > 1;
  for (std::size_t i = 0; i < (shares_frames ? 1 : threads()); ++i) {
    lanes_.push_back(std::make_unique<Lane>(capacity, lane_depth, shares_frames ? threads() + 1 : 1,
                                            shares_frames));
  }
  for (std::size_t i = 0; i < threads(); ++i) {
    estimators_.push_back(std::make_unique<LaneEstimator>(
        make_estimators(options_, max_photons_, pixels_of_thread(options_, i, threads()))));
  }
  estimators_.push_back(std::make_unique<LaneEstimator>(make_field(options_, max_photons_)));
}

// The framer and the estimation end once the source has, and the frames that nobody takes are let
// through.
Stream::~Stream() {
  request_stop();
  while (source_thread_ && !ended()) {
    if (next() != nullptr) {
      release();
    } else {
      wait(idle);
    }
  }
}

void Stream::start() {
  threads_.emplace_back([this] { framer_.run(stop_.get_token(), stop_patience_ms); });
  for (std::size_t i = 0; i < threads(); ++i) {
    threads_.emplace_back([this, i] { estimate(i); });
  }
  if (options_.pixels.size() > 1) threads_.emplace_back([this] { join_pixels(); });
  source_thread_.emplace(*source_, ring_, stop_.get_token());
}

const EstimationUnit* Stream::next() { return lanes_[next_]->estimated_unit(); }

void Stream::release() {
  lanes_[next_]->release();
  dealer_.notify_released();
  next_ = (next_ + 1) % lanes_.size();
}

// Frames were dealt out in turn, so the first lane without a next frame ends them all.
bool Stream::ended() const { return lanes_[next_]->publisher_done(); }

std::exception_ptr Stream::join() {
  source_thread_->join();
  threads_.clear();
  return source_thread_->fault();
}

void Stream::tap_into(TagTap* tap) {
  framer_.tap_into(tap);
  if (tap == nullptr) framer_.wait_for_tap();
}

Stream::Make Stream::maker(const StreamOptions& next) const {
  StreamOptions options = options_;
  options.pulse = next.pulse;
  options.scene = next.scene;
  options.estimator = next.estimator;
  options.detector = next.detector;
  return [options, photons = max_photons_, threads = threads()](const std::stop_token& stop) {
    NewEstimators made{{}, options.estimator.effort};
    while (made.each.size() < threads) {
      if (stop.stop_requested()) throw Error(Fault::usage, "the program ends");
      const auto pixels = pixels_of_thread(options, made.each.size(), threads);
      made.each.push_back(make_estimators(options, photons, pixels));
    }
    made.each.push_back(make_field(options, photons));
    return made;
  };
}

void Stream::reload(NewEstimators made) {
  const std::scoped_lock lock(reload_mutex_);
  for (std::size_t i = 0; i < estimators_.size(); ++i) {
    estimators_[i]->hand_in(std::move(made.each[i]));
  }
  dealer_.configure(made.effort);
}

void Stream::request_stop() {
  std::int64_t not_yet = 0;
  stopped_ns_.compare_exchange_strong(not_yet, clock_.steady_ns());
  stop_.request_stop();
}

bool Stream::out_of_patience() const {
  const std::int64_t stopped_ns = stopped_ns_;
  return stopped_ns != 0 && clock_.steady_ns() - stopped_ns > stop_patience_ms * ns_in_ms;
}

StreamCounters Stream::counters() const {
  return {framer_.totals(), source_thread_ ? source_thread_->dropped_tags() : 0,
          framer_.discarded(), source_->counters()};
}

double Stream::take_highest_fill() {
  return static_cast<double>(framer_.take_highest_fill()) / static_cast<double>(ring_.capacity());
}

const SyncDiagnosis* Stream::diagnosis() const {
  return framer_.diagnosed() ? &*framer_.diagnosis() : nullptr;
}

void Stream::estimate(std::size_t index) {
  pthread_setname_np(pthread_self(), ("estimate-" + std::to_string(index)).c_str());
  const bool shares_frames = options_.pixels.size() > 1;
  Lane& lane = *lanes_[shares_frames ? 0 : index];
  const std::size_t place = shares_frames ? index : 0;
  LaneEstimator& estimator = *estimators_[index];
  const std::size_t step = shares_frames ? threads() : 1;
  const auto no_tracks = [&] {
    std::vector<array::PixelTrack> none;
    for (std::size_t k = 0; k < estimator.in_use().of_pixel.size(); ++k) {
      none.emplace_back(index + k * step);
    }
    return none;
  };
  std::vector<array::PixelTrack> tracks = no_tracks();
  while (!lane.estimator_done(place)) {
    EstimationUnit* unit = lane.filled_unit(place);
    if (unit == nullptr) {
      lane.wait(place, idle);
      continue;
    }
    if (estimator.take_next()) tracks = no_tracks();
    estimate(*unit, index, tracks);
    lane.estimated(place);
    wake_.notify();
  }
  wake_.notify();
}

// Estimates the pixels of each frame together, where the scene asks for that.
void Stream::join_pixels() {
  pthread_setname_np(pthread_self(), "estimate-field");
  Lane& lane = *lanes_[0];
  const std::size_t place = threads();
  LaneEstimator& estimator = *estimators_[place];
  while (!lane.estimator_done(place)) {
    EstimationUnit* unit = lane.filled_unit(place);
    if (unit == nullptr) {
      lane.wait(place, idle);
      continue;
    }
    (void)estimator.take_next();
    FieldEstimator* field = estimator.in_use().field.get();
    if (field != nullptr && !out_of_patience()) field->estimate(*unit);
    lane.estimated(place);
    wake_.notify();
  }
  wake_.notify();
}

// The thread's share of a frame. A part that there is no time for counts as not seen: its photons
// stay counted in it.
void Stream::estimate(EstimationUnit& unit, std::size_t index,
                      std::vector<array::PixelTrack>& tracks) {
  EstimatorInUse& with = estimators_[index]->in_use();
  const auto estimate_part = [&](Frame& part, std::size_t k, Estimate& estimate, double& took_ms) {
    const std::int64_t begin_ns = clock_.steady_ns();
    const bool too_late = out_of_patience();
    if (too_late) part.seen_fraction = 0;
    estimate = unit.wanted && !too_late
                   ? with.of(k).estimate(part.view(), with.tracked ? &tracks[k].track() : nullptr,
                                         unit.effort)
                   : Estimate{};
    took_ms = static_cast<double>(clock_.steady_ns() - begin_ns) / 1e6;
  };
  if (unit.pixels.empty()) return estimate_part(unit.frame, 0, unit.estimate, unit.compute_ms);
  for (std::size_t p = index, k = 0; p < unit.pixels.size(); p += threads(), ++k) {
    PixelEstimate& pixel = unit.pixels[p];
    if (with.helped) tracks[k].begin_frame(pixel.help);
    estimate_part(*unit.frame.pixels[p], k, pixel.estimate, pixel.compute_ms);
    if (with.helped) pixel.seen = tracks[k].seen();
  }
}

}  // namespace splid
