#include "bench/soak/faulty_source.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"
#include "drivers/replay/replay.hpp"
#include "tests/support/vector_sink.hpp"

namespace splid::soak {
namespace {

constexpr std::int64_t ms = 1'000'000'000;
constexpr std::int64_t second = 1000 * ms;
constexpr double leg_s = 10;

constexpr std::int64_t between_faults_ps = 2 * second;
constexpr std::int64_t doubled_by_ps = 20'000;
constexpr int flood_photons = 20'000;
constexpr int other_tags = 1000;
constexpr int other_input = 7;
// The framer sets its clock back after 16 such tags in a row; it counts the first 15 as late.
constexpr int tags_until_believed = 15;

struct Kind {
  const char* name;
  std::int64_t lasts_ps;
};
constexpr std::array<Kind, fault_count> kinds = {{{"none", 0},
                                                  {"loss, counted", 3 * ms},
                                                  {"loss, not counted", 3 * ms},
                                                  {"tags missed", 1 * ms},
                                                  {"gap, unsaid", 3 * ms},
                                                  {"silence of 0.5 s", 500 * ms},
                                                  {"clock 6 s ahead, unsaid", 0},
                                                  {"clock 3 s back, unsaid", 0},
                                                  {"clock 3 s back, said", 0},
                                                  {"stray time stamp", 0},
                                                  {"1,000 tags elsewhere", 0},
                                                  {"dark for 5 frames", 250 * ms},
                                                  {"no sync for 4 frames", 200 * ms},
                                                  {"doubled syncs", 10 * ms},
                                                  {"20,000 photons at once", 0}}};

}  // namespace

const char* to_string(StreamFault fault) { return kinds.at(static_cast<std::size_t>(fault)).name; }

// Stands between a driver and the ring. It moves the times of a leg to where the leg belongs, and
// injects the faults.
class FaultySource::Faults final : public TagSink {
 public:
  Faults(TagSink& to, Injected& injected) : out_(to), injected_(injected) {}

  void begin_leg(std::int64_t leg, std::int64_t leg_ps) {
    base_ps_ = leg * leg_ps;
    leg_end_ps_ = base_ps_ + leg_ps;
  }
  std::span<Tag> claim(std::size_t max_count) override {
    return std::span(room_).first(std::min(max_count, room_.size()));
  }
  void publish(std::size_t count) override {
    for (const Tag& tag : std::span(room_).first(count)) pass(tag);
    out_.publish();
  }

 private:
  void pass(Tag tag) {
    const std::int64_t at_ps = base_ps_ + tag.time_ps;
    if (at_ps >= leg_end_ps_) return;  // a photon of a pulse of this leg, or its last heartbeat
    now_ps_ = at_ps;
    if (fault_ != StreamFault::none && now_ps_ >= until_ps_) end();
    if (fault_ == StreamFault::none && now_ps_ >= next_ps_) begin();
    tag.time_ps = now_ps_ + step_ps_;
    if (fault_ != StreamFault::none && swallows(tag)) return;
    put(tag);
  }

  void put(const Tag& tag) {
    if (!out_.put(tag)) return;
    const std::uint64_t events = is_event(tag.kind) ? 1 : 0;
    injected_.events += events;
    if (doubted_ == 0) return;
    --doubted_;
    injected_.late += events;
  }
  void put(TagKind kind, std::int32_t value) { put(Tag{now_ps_ + step_ps_, value, kind, {}}); }

  void begin() {
    turn_ = turn_ % (fault_count - 1) + 1;
    fault_ = static_cast<StreamFault>(turn_);
    ++injected_.faults.at(turn_);
    left_out_ = 0;
    until_ps_ = now_ps_ + kinds.at(turn_).lasts_ps;
    next_ps_ += between_faults_ps / 2 + static_cast<std::int64_t>(random_() % between_faults_ps);
    switch (fault_) {
      case StreamFault::reported_loss:
      case StreamFault::uncounted_loss:
        return put(TagKind::loss_begin, 0);
      case StreamFault::clock_forward:
        step_ps_ += 6 * second;
        break;
      case StreamFault::clock_back:
        step_ps_ -= 3 * second;
        doubted_ = tags_until_believed;
        break;
      case StreamFault::clock_break:
        step_ps_ -= 3 * second;
        put(TagKind::clock_break, 0);
        break;
      case StreamFault::stray:
        doubted_ = 1;
        put(photon_tag(now_ps_ + step_ps_ + 5 * second, 1));
        break;
      case StreamFault::other_channel:
        for (int i = 0; i < other_tags; ++i) put(TagKind::photon, other_input);
        break;
      case StreamFault::flood:
        for (int i = 0; i < flood_photons; ++i) put(TagKind::photon, 1);
        break;
      default:
        return;
    }
    fault_ = StreamFault::none;
  }

  bool swallows(const Tag& tag) {
    switch (fault_) {
      case StreamFault::dark:
        return tag.kind == TagKind::photon;
      case StreamFault::no_sync:
        return tag.kind == TagKind::sync;
      case StreamFault::doubled_sync:
        if (tag.kind == TagKind::sync) put(tag);
        if (tag.kind == TagKind::sync) put(sync_tag(tag.time_ps + doubled_by_ps));
        return tag.kind == TagKind::sync;
      default:
        left_out_ += is_event(tag.kind) ? 1 : 0;
        return true;
    }
  }

  void end() {
    const bool is_counted =
        fault_ == StreamFault::reported_loss || fault_ == StreamFault::missed_tags;
    if (is_counted) injected_.reported += static_cast<std::uint64_t>(left_out_);
    if (fault_ == StreamFault::reported_loss) put(TagKind::loss_end, left_out_);
    if (fault_ == StreamFault::uncounted_loss) put(TagKind::loss_end, -1);
    if (fault_ == StreamFault::missed_tags) put(TagKind::missed, left_out_);
    fault_ = StreamFault::none;
  }

  TagWriter out_;
  Injected& injected_;
  std::vector<Tag> room_ = std::vector<Tag>(1 << 12);
  std::mt19937_64 random_{1};
  std::int64_t base_ps_ = 0;
  std::int64_t leg_end_ps_ = 0;
  std::int64_t now_ps_ = 0;   // time of the scene
  std::int64_t step_ps_ = 0;  // by which the instrument's clock is ahead of it
  std::size_t turn_ = 0;
  StreamFault fault_ = StreamFault::none;
  int doubted_ = 0;            // number of tags still to come that the framer will call late
  std::int32_t left_out_ = 0;  // number of events that the running fault has left out
  std::int64_t until_ps_ = 0;
  std::int64_t next_ps_ = between_faults_ps;
};

FaultySource::FaultySource(Pattern pattern, simulator::Options scene, std::string recording,
                           double seconds)
    : pattern_(std::move(pattern)),
      scene_(std::move(scene)),
      recording_(std::move(recording)),
      seconds_(seconds) {
  const double period_ps = pattern_period_ps(pattern_);
  leg_ps_ = std::llround(std::ceil(leg_s * 1e12 / period_ps) * period_ps);
  scene_.pace = simulator::Speed::max;
  scene_.drift_ppm = 0;  // with a drift the syncs of the legs would not follow each other
  scene_.seconds = static_cast<double>(leg_ps_) * 1e-12;
}

void FaultySource::run(TagSink& sink, std::stop_token stop) {
  record(stop);
  Faults faults(sink, injected_);
  const double leg_seconds = static_cast<double>(leg_ps_) * 1e-12;
  for (std::int64_t leg = 0; injected_.device_s < seconds_ && !stop.stop_requested(); ++leg) {
    faults.begin_leg(leg, leg_ps_);
    if (leg % 2 == 0) {
      simulate(faults, stop, leg + 1);
      ++injected_.simulated_legs;
    } else {
      replay(faults, stop);
      ++injected_.replayed_legs;
    }
    injected_.device_s += leg_seconds;
  }
}

void FaultySource::record(const std::stop_token& stop) {
  test::VectorSink tags;
  simulate(tags, stop, 0);
  recording::PtuWriter writer(recording_, {}, DeviceClock({"soak", false, 0.0}, host_clock()),
                              true);
  writer.write(tags.tags);
  writer.close();
}

void FaultySource::simulate(TagSink& sink, const std::stop_token& stop, std::int64_t seed) const {
  simulator::Options options = scene_;
  options.seed = seed;
  SourceContext context;
  context.pattern = &pattern_;
  options.open(context)->run(sink, stop);
}

void FaultySource::replay(TagSink& sink, const std::stop_token& stop) const {
  ReplayOptions options;
  options.recording = recording_;
  SourceContext context;
  context.pattern = &pattern_;
  options.open(context)->run(sink, stop);
}

}  // namespace splid::soak
