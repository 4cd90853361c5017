#include "daemon/stream/encoder_feed.hpp"

#include <gtest/gtest.h>

#include <mutex>
#include <thread>

#include "tests/support/held_clock.hpp"

namespace splid {
namespace {

constexpr std::int64_t ms = 1'000'000'000;

// Hands out what another thread gave it.
class FedEncoder final : public EncoderSource {
 public:
  bool next(EncoderBatch& batch) override {
    const std::lock_guard lock(mutex_);
    if (batches_.empty()) return false;
    batch = batches_.back();
    batches_.pop_back();
    return true;
  }
  [[nodiscard]] bool live() const override { return true; }
  void give(const EncoderBatch& batch) {
    const std::lock_guard lock(mutex_);
    batches_.push_back(batch);
  }

 private:
  std::mutex mutex_;
  std::vector<EncoderBatch> batches_;
};

// 1 kHz, counts that are their index plus 1000.
struct Bench {
  // clock: outlives this.
  explicit Bench(const Clock& host) : clock(host), frame(FrameCapacity{16, 16, 64, 4}) {
    auto made = std::make_unique<FedEncoder>();
    source = made.get();
    EncoderOptions options;
    options.m_per_count = 0.001;
    feed.emplace(std::move(made), options, clock);
    next_frame(false);
    next_frame(false);
  }

  std::optional<FrameMessage::Reference> next_frame(bool ticks) {
    frame.start_ps = frame.end_ps;
    frame.end_ps += length_ms * ms;
    frame.markers.clear();
    for (int i = 0; ticks && i < length_ms; ++i) frame.markers.push({frame.start_ps + i * ms, 1});
    frame.arrival_ns = clock.steady_ns();
    return feed->reference(frame);
  }
  void give(std::int64_t first_index, std::int64_t number) const {
    EncoderBatch batch{first_index, {}};
    for (std::int64_t i = 0; i < number; ++i) batch.counts.push_back(1'000 + first_index + i);
    source->give(batch);
  }

  const Clock& clock;
  std::int64_t length_ms = 50;
  Frame frame;
  FedEncoder* source;
  std::optional<EncoderFeed> feed;
};

TEST(EncoderFeed, AFramesReferenceIsItsEncodersPlaceAndSlope) {
  const HeldClock clock;
  Bench bench(clock);
  bench.give(0, 50);
  const auto reference = bench.next_frame(true);
  ASSERT_TRUE(reference);
  EXPECT_NEAR(*reference->distance_m, 1.025, 1e-9);
  EXPECT_NEAR(*reference->velocity_mps, 1, 1e-9);
}

// The clock stands still, so however long they take it is not too long.
TEST(EncoderFeed, WaitsForCountsThatComeLate) {
  const HeldClock clock;
  Bench bench(clock);
  bench.give(0, 25);
  std::jthread late([&bench] {
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
    bench.give(25, 25);
  });
  EXPECT_TRUE(bench.next_frame(true));
}

TEST(EncoderFeed, GoesOnWithoutCountsThatDoNotCome) {
  Bench bench(host_clock());
  bench.give(0, 25);
  EXPECT_FALSE(bench.next_frame(true));
  // They come after all, for this frame too late.
  bench.give(25, 75);
  EXPECT_TRUE(bench.next_frame(true));
}

// Goes on by a tenth of a millisecond each time that it is looked at.
class LookedAtClock final : public Clock {
 public:
  [[nodiscard]] double unix_s() const override { return 0; }
  [[nodiscard]] std::int64_t steady_ns() const override { return now_ns_ += 100'000; }

 private:
  mutable std::int64_t now_ns_ = 1'000'000'000;
};

double waited_ms(std::int64_t length_ms) {
  const LookedAtClock clock;
  Bench bench(clock);
  bench.length_ms = length_ms;
  bench.give(0, length_ms / 2);
  const std::int64_t begin_ns = clock.steady_ns();
  EXPECT_FALSE(bench.next_frame(true));
  return static_cast<double>(clock.steady_ns() - begin_ns) / 1e6;
}

TEST(EncoderFeed, WaitsForLateCountsForLessThanItsFramesLength) {
  EXPECT_NEAR(waited_ms(50), 40, 1);
  EXPECT_NEAR(waited_ms(100), 40, 1);
  EXPECT_NEAR(waited_ms(10), 8, 1);
}

// Has a next batch whenever it is asked, each of which begins anew.
class FloodingEncoder final : public EncoderSource {
 public:
  bool next(EncoderBatch& batch) override {
    batch = {0, {1}, false};
    return ++asked < 1'000'000;
  }
  [[nodiscard]] bool live() const override { return true; }

  int asked = 0;
};

TEST(EncoderFeed, AFloodOfCountsHoldsNoFrame) {
  auto made = std::make_unique<FloodingEncoder>();
  const FloodingEncoder& source = *made;
  EncoderFeed feed(std::move(made), {}, host_clock());
  Frame frame(FrameCapacity{16, 16, 64, 4});
  for (int i = 1; i <= 3; ++i) {
    frame.end_ps = i * 50 * ms;
    EXPECT_FALSE(feed.reference(frame));
    frame.start_ps = frame.end_ps;
    EXPECT_EQ(source.asked, i * 4096);
  }
}

}  // namespace
}  // namespace splid
