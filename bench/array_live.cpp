// Measures an array live: tags of all pixels at the rate of an instrument, through ring, framer and
// estimation threads, 20 frames a second. The tags of a quarter of a second are made beforehand and
// played over and over, so that the processor is the stream's alone.
//
//   array_live [--pixels N] [--light X] [--followed] [--threads N] [--seconds N] [--findings-off]
//              [--rigid]
//
// --light: of [P]'s; --followed: pixels follow their targets and help each other; otherwise each is
// searched whole. Prints one line of a table. Latency is from a frame's end to its estimates.

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/pace.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/process_memory.hpp"
#include "tests/support/vector_sink.hpp"

namespace splid {
namespace {

using std::chrono::steady_clock;

struct Choice {
  std::size_t pixels = 128;
  double light = 1;
  bool followed = false, findings = true, rigid = false;
  std::int64_t threads = 2;
  double seconds = 10;
};

constexpr std::int64_t slice_ps = 1'000'000'000;

// A wall of the pixels' own tilt: neighbours are some centimetres apart.
simulator::Options field(const Choice& choice, double seconds) {
  simulator::Options scene;
  scene.pace = simulator::Speed::max;
  scene.seconds = seconds;
  scene.drift_ppm = 0;
  scene.ambient_per_s *= choice.light;
  scene.array.columns = 16;
  scene.array.rows = static_cast<std::int64_t>((choice.pixels + 15) / 16);
  simulator::Plane wall;
  wall.path.motion = simulator::MotionKind::linear;
  wall.path.distance_m = 30;
  wall.tilt_azimuth_deg = 30;
  wall.signal_per_pulse *= choice.light;
  scene.array.planes = {wall};
  return scene;
}

// Plays tags over and over, as a live source does that has them in its memory.
class LoopSource : public TagSource {
 public:
  LoopSource(std::vector<Tag> tags, std::int64_t loop_ps, double seconds,
             steady_clock::time_point& start)
      : tags_(std::move(tags)),
        loop_ps_(loop_ps),
        end_ps_(static_cast<std::int64_t>(seconds * 1e12)),
        start_(start) {}

  [[nodiscard]] SourceInfo info() const override { return {"loop", true, std::nullopt}; }

  void run(TagSink& sink, std::stop_token stop) override {
    start_ = steady_clock::now();
    const Pace pace(1);
    std::size_t next = 0;
    std::int64_t added_ps = 0;
    for (std::int64_t now_ps = slice_ps; now_ps <= end_ps_; now_ps += slice_ps) {
      if (!pace.wait_until(now_ps, stop)) return;
      while (true) {
        const std::int64_t until_ps = now_ps - added_ps;
        std::size_t end = next;
        while (end < tags_.size() && tags_[end].time_ps < until_ps) ++end;
        if (!put(sink, next, end, added_ps)) return;
        next = end;
        if (next < tags_.size()) break;
        next = 0;
        added_ps += loop_ps_;
        if (added_ps >= now_ps) break;
      }
    }
  }

 private:
  bool put(TagSink& sink, std::size_t from, std::size_t to, std::int64_t added_ps) {
    while (from < to) {
      const std::span<Tag> room = sink.claim(to - from);
      if (room.empty()) return false;
      const std::size_t count = std::min(room.size(), to - from);
      for (std::size_t i = 0; i < count; ++i) {
        room[i] = tags_[from + i];
        room[i].time_ps += added_ps;
      }
      sink.publish(count);
      from += count;
    }
    return true;
  }

  std::vector<Tag> tags_;
  std::int64_t loop_ps_, end_ps_;
  steady_clock::time_point& start_;
};

double processor_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

StreamOptions options_of(const Choice& choice, const Pattern& pattern) {
  StreamOptions options = stream_options(Config{});
  options.pattern = pattern;
  options.estimator.tracked = choice.followed;
  options.estimator.findings = choice.findings ? FindingsWanted::on : FindingsWanted::off;
  options.scene.rigid = choice.rigid;
  options.pipeline.estimation_threads = choice.threads;
  options.pipeline.ring_capacity_tags = 1 << 24;
  for (std::size_t p = 0; p < choice.pixels; ++p) {
    PixelOptions pixel;
    pixel.input = static_cast<std::int64_t>(p) + 1;
    pixel.name = std::to_string(p + 1);
    pixel.azimuth_deg = 0.1 * static_cast<double>(p % 16);
    pixel.elevation_deg = -0.1 * static_cast<double>(p / 16);
    options.pixels.push_back(pixel);
    options.channels.pixels.push_back(pixel.input);
    options.channels.delays_ps.push_back(0);
  }
  return options;
}

struct Seen {
  std::vector<double> latencies_ms;
  std::size_t frames = 0, fast = 0, pixels = 0, ok = 0;
  std::uint64_t lost_tags = 0;
};

// The first second, in which memory is touched for the first time and all pixels are searched at
// once, does not count for the latency.
void take(const EstimationUnit& unit, steady_clock::time_point start, Seen& seen) {
  const std::chrono::duration<double, std::milli> now = steady_clock::now() - start;
  ++seen.frames;
  seen.lost_tags += unit.frame.lost_tags;
  if (unit.frame.end_ps < 1'000'000'000'000) return;
  seen.latencies_ms.push_back(now.count() - static_cast<double>(unit.frame.end_ps) * 1e-9);
  seen.fast += unit.effort == Effort::fast ? 1 : 0;
  for (const PixelEstimate& pixel : unit.pixels) {
    ++seen.pixels;
    seen.ok += pixel.estimate.status == FrameStatus::ok ? 1 : 0;
  }
}

double share_of(std::vector<double> sorted, double share) {
  std::sort(sorted.begin(), sorted.end());
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

void measure(const Choice& choice) {
  const Pattern pattern = make_interleaved(std::array{180'000.0, 189'000.0});
  const double period_ps = pattern_period_ps(pattern);
  const auto periods = static_cast<std::int64_t>(0.25e12 / period_ps);
  const std::int64_t loop_ps = periods * std::llround(period_ps);
  test::VectorSink made;
  SourceContext context;
  context.pattern = &pattern;
  field(choice, static_cast<double>(loop_ps) * 1e-12).open(context)->run(made, {});
  std::erase_if(made.tags, [](const Tag& tag) { return !is_event(tag.kind); });
  const double tags_a_second =
      static_cast<double>(made.tags.size()) / static_cast<double>(loop_ps) * 1e12;
  const double tags_mib = static_cast<double>(made.tags.size() * sizeof(Tag)) / (1 << 20);

  steady_clock::time_point start;
  Stream stream(options_of(choice, pattern),
                std::make_unique<LoopSource>(std::move(made.tags), loop_ps, choice.seconds, start),
                host_clock());
  const double begun_s = processor_s();  // after the tags and the estimators were made
  Seen seen;
  stream.start();
  while (!stream.ended()) {
    if (const EstimationUnit* unit = stream.next()) {
      take(*unit, start, seen);
      stream.release();
    } else {
      stream.wait(std::chrono::milliseconds{50});
    }
  }
  (void)stream.join();
  const StreamCounters counters = stream.counters();
  std::printf(
      "| %zu | %g | %.1f | %s%s%s | %.2f | %zu | %llu | %zu | %.1f | %.1f | %.1f | %.0f |\n",
      choice.pixels, choice.light, tags_a_second * 1e-6, choice.followed ? "followed" : "searched",
      choice.findings ? "" : ", no findings", choice.rigid ? ", `rigid`" : "",
      (processor_s() - begun_s) / choice.seconds, seen.frames,
      static_cast<unsigned long long>(counters.dropped_tags), seen.fast,
      100.0 * static_cast<double>(seen.ok) / static_cast<double>(seen.pixels),
      share_of(seen.latencies_ms, 0.5), share_of(seen.latencies_ms, 0.99),
      test::memory_mib("VmRSS") - tags_mib);
}

Choice choice_of(int count, char** words) {
  Choice choice;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const auto number = [&] { return i + 1 < count ? std::atof(words[++i]) : 0; };
    if (word == "--pixels")
      choice.pixels = static_cast<std::size_t>(number());
    else if (word == "--light")
      choice.light = number();
    else if (word == "--threads")
      choice.threads = static_cast<std::int64_t>(number());
    else if (word == "--seconds")
      choice.seconds = number();
    else if (word == "--followed")
      choice.followed = true;
    else if (word == "--findings-off")
      choice.findings = false;
    else if (word == "--rigid")
      choice.rigid = true;
    else
      std::exit(2);
  }
  return choice;
}

}  // namespace
}  // namespace splid

int main(int count, char** words) {
  std::printf(
      "| pixels | of [P]'s light | M tags/s | how | cores | frames | lost tags | at `fast` | ok, "
      "%% | "
      "p50 ms | p99 ms | MiB |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  splid::measure(splid::choice_of(count, words));
}
