#include "daemon/output/liveness.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

constexpr std::int64_t s = 1'000'000'000;

TEST(Liveness, FramesThatComeOutAreLifeWhateverElseStands) {
  Liveness liveness(50);
  for (std::uint64_t i = 0; i < 10; ++i) {
    EXPECT_TRUE(
        liveness.is_alive({.frames = i, .ring_is_empty = false}, static_cast<std::int64_t>(i) * s));
  }
}

TEST(Liveness, TagsThatWaitWhileNoFrameComesOutAreNot) {
  Liveness liveness(50);
  WorkSeen seen{.frames = 1, .ring_touches = 0, .ring_is_empty = false};
  EXPECT_TRUE(liveness.is_alive(seen, 0));
  ++seen.ring_touches;
  EXPECT_TRUE(liveness.is_alive(seen, 2 * s - 1));
  ++seen.ring_touches;
  EXPECT_FALSE(liveness.is_alive(seen, 2 * s));
  ++seen.frames;
  EXPECT_TRUE(liveness.is_alive(seen, 3 * s));
}

// 4 frames of one second.
TEST(Liveness, LongFramesHaveFourOfTheirLengths) {
  Liveness liveness(1000);
  const WorkSeen seen{.frames = 1, .ring_is_empty = false};
  EXPECT_TRUE(liveness.is_alive(seen, 0));
  EXPECT_TRUE(liveness.is_alive(seen, 4 * s - 1));
  EXPECT_FALSE(liveness.is_alive(seen, 4 * s));
}

TEST(Liveness, AnInstrumentThatIsSilentIsLifeWhileItsThreadIsAtWork) {
  Liveness liveness(50);
  WorkSeen seen;
  for (std::int64_t i = 0; i < 100; ++i) {
    ++seen.ring_touches;
    EXPECT_TRUE(liveness.is_alive(seen, i * s));
  }
  EXPECT_TRUE(liveness.is_alive(seen, 102 * s - 1));
  EXPECT_FALSE(liveness.is_alive(seen, 102 * s));
}

TEST(Liveness, AReplayHasNothingToSayWhileItWaits) {
  Liveness liveness(50);
  const WorkSeen seen{.source_is_live = false};
  EXPECT_TRUE(liveness.is_alive(seen, 0));
  EXPECT_TRUE(liveness.is_alive(seen, 1000 * s));
}

}  // namespace
}  // namespace splid
