#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>
#include <vector>

#include "daemon/stream/framer.hpp"
#include "daemon/stream/ring.hpp"
#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_header.hpp"

// The tags that go through ring and framer in a second, on two threads and with nothing behind
// them.

namespace splid {
namespace {

constexpr double period_ps = 3'780'000;
constexpr std::size_t ring_capacity = 1 << 22;
constexpr std::size_t block = 16'384;

class OneFrame final : public FrameSink {
 public:
  explicit OneFrame(const FrameCapacity& capacity) : frame_(capacity) {}
  Frame& open() override { return frame_; }
  void close() override { ++frames; }
  std::size_t frames = 0;

 private:
  Frame frame_;
};

// 20 ms of photons at a rate, with a sync every 3.78 us, which are repeated with shifted times.
std::vector<Tag> one_block(double photons_per_s) {
  std::vector<Tag> tags;
  std::mt19937_64 random(1);
  std::exponential_distribution<double> gap(photons_per_s * 1e-12);
  double photon_ps = gap(random);
  for (int k = 0; k < 5291; ++k) {
    const double sync_ps = k * period_ps;
    for (; photon_ps < sync_ps; photon_ps += gap(random)) {
      tags.push_back(photon_tag(static_cast<std::int64_t>(photon_ps), 1));
    }
    tags.push_back(sync_tag(static_cast<std::int64_t>(sync_ps)));
  }
  return tags;
}

// The consumer's side: puts everything in the ring through the framer.
void frame_all(TagRing& ring, Framer& framer) {
  while (!ring.ended()) {
    const auto tags = ring.wait(std::chrono::seconds(1), {});
    const auto some = tags.first(std::min(tags.size(), block));
    framer.push(some, 0);
    ring.consume(some.size());
  }
  framer.finish();
}

void copy_shifted(const std::vector<Tag>& tags, int times, TagSink& sink) {
  const auto length_ps = static_cast<std::int64_t>(5291 * period_ps);
  for (int i = 0; i < times; ++i) {
    const std::int64_t shift_ps = i * length_ps;
    for (std::size_t at = 0; at < tags.size();) {
      const std::span<Tag> room = sink.claim(std::min(block, tags.size() - at));
      std::copy_n(tags.begin() + static_cast<std::ptrdiff_t>(at), room.size(), room.begin());
      for (Tag& tag : room) tag.time_ps += shift_ps;
      sink.publish(room.size());
      at += room.size();
    }
  }
}

void ring_and_framer(benchmark::State& state) {
  const std::vector<Tag> tags = one_block(static_cast<double>(state.range(0)) * 1e6);
  const int times = static_cast<int>(40'000'000 / tags.size());
  const FramerOptions options{50, period_ps, DriftMethod::regression, 1 << 16};
  const ChannelMap channels{ChannelOptions{}};
  OneFrame frames({ring_capacity, 1 << 16, 1 << 10, 256});
  for (auto _ : state) {
    TagRing ring(ring_capacity);
    Framer framer(options, channels, frames);
    const auto begin = std::chrono::steady_clock::now();
    std::jthread producer([&](const std::stop_token& stop) {
      WaitingSink sink(ring, stop);
      copy_shifted(tags, times, sink);
      sink.finish();
    });
    frame_all(ring, framer);
    producer.join();
    state.SetIterationTime(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (framer.totals().late + framer.totals().surplus > 0) state.SkipWithError("tags lost");
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * tags.size()) * times);
}
// In million photons a second. The fastest USB tagger sends less than 50.
BENCHMARK(ring_and_framer)
    ->Arg(50)
    ->Arg(10)
    ->Arg(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

void framer_alone(benchmark::State& state) {
  const std::vector<Tag> tags = one_block(static_cast<double>(state.range(0)) * 1e6);
  const ChannelMap channels{ChannelOptions{}};
  OneFrame frames({ring_capacity, 1 << 16, 1 << 10, 256});
  for (auto _ : state) {
    Framer framer({50, period_ps, DriftMethod::regression, 1 << 16}, channels, frames);
    framer.push(tags, 0);
    framer.finish();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * tags.size()));
}
BENCHMARK(framer_alone)->Arg(50)->Arg(10)->Arg(1)->Unit(benchmark::kMillisecond);

// 40 M photons a second, dealt out to so many pixels.
void framer_of_pixels(benchmark::State& state) {
  constexpr double photons_per_s = 40e6;
  const auto pixels = static_cast<std::size_t>(state.range(0));
  std::vector<Tag> tags = one_block(photons_per_s);
  std::mt19937 random(2);
  for (Tag& tag : tags) {
    if (tag.kind == TagKind::photon) tag.value = static_cast<std::int32_t>(random() % pixels);
  }
  ChannelOptions options;
  for (std::size_t i = 0; i < pixels; ++i) options.pixels.push_back(static_cast<std::int64_t>(i));
  const ChannelMap channels{options};
  FrameCapacity capacity{ring_capacity / pixels, 1 << 16, 1 << 10, 256};
  capacity.pixels = pixels;
  OneFrame frames(capacity);
  for (auto _ : state) {
    Framer framer({50, period_ps, DriftMethod::regression, 1 << 16}, channels, frames);
    framer.push(tags, 0);
    framer.finish();
    if (framer.totals().late + framer.totals().surplus > 0) state.SkipWithError("tags lost");
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * tags.size()));
}
BENCHMARK(framer_of_pixels)->Arg(16)->Arg(64)->Arg(1024)->Unit(benchmark::kMillisecond);

// The records of the PTU recording that SPLID_BENCH_PTU names, through decoder, ring and framer.
void decoder_ring_and_framer(benchmark::State& state) {
  const char* file = std::getenv("SPLID_BENCH_PTU");
  if (file == nullptr || !std::filesystem::exists(file)) {
    state.SkipWithError("set SPLID_BENCH_PTU to a recording");
    return;
  }
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
  const RecordingHeader header = parse_ptu_header(bytes, true).value();
  const ChannelMap channels{ChannelOptions{}};
  OneFrame frames({ring_capacity, 1 << 16, 1 << 10, 256});
  std::uint64_t events = 0;
  for (auto _ : state) {
    TagRing ring(ring_capacity);
    Framer framer({50, period_ps, DriftMethod::regression, 1 << 16}, channels, frames);
    const auto begin = std::chrono::steady_clock::now();
    std::jthread producer([&](const std::stop_token& stop) {
      WaitingSink sink(ring, stop);
      PtuDecoder decoder(header.record_type, header.resolution_s);
      for (auto left = bytes.subspan(header.header_bytes); left.size() >= 4;) {
        const auto done = decoder.decode(left, sink.claim(block));
        sink.publish(done.tags);
        left = left.subspan(done.bytes);
      }
      sink.finish();
    });
    frame_all(ring, framer);
    producer.join();
    state.SetIterationTime(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    events += framer.totals().events;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(events));
}
BENCHMARK(decoder_ring_and_framer)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace splid
