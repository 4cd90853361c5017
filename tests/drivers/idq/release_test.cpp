#include "drivers/idq/release.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/support/vector_sink.hpp"

namespace splid::idq {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;

constexpr std::int64_t ps_a_ms = 1'000'000'000;
constexpr std::int64_t period_ps = 200 * ps_a_ms + 40'000;

Tag loss(TagKind kind, std::int64_t time_ps) {
  return {time_ps, kind == TagKind::loss_end ? -1 : 0, kind, {}};
}

class ReleaseOfTwo : public ::testing::Test {
 protected:
  ReleaseOfTwo() { options.inputs = {{1}, {4}}; }

  Options options;
  test::VectorSink sink;
  Release release{options, sink};
  Release::Time now{std::chrono::hours{1}};
};

TEST_F(ReleaseOfTwo, TimesOfAllInputsAreInOrderAndTheDeadTimeIsALoss) {
  release.add({0, {{20, 30}, {10, 30, 40}}, false}, now);
  release.add({1, {{}, {5}}, false}, now);
  release.flush();
  EXPECT_THAT(
      sink.tags,
      ElementsAre(photon_tag(10, 4), photon_tag(20, 1), photon_tag(30, 1), photon_tag(30, 4),
                  photon_tag(40, 4), loss(TagKind::loss_begin, 200 * ps_a_ms),
                  loss(TagKind::loss_end, period_ps), heartbeat_tag(period_ps),
                  photon_tag(period_ps + 5, 4),
                  loss(TagKind::loss_begin, period_ps + 200 * ps_a_ms),
                  loss(TagKind::loss_end, 2 * period_ps), heartbeat_tag(2 * period_ps)));
  EXPECT_EQ(release.reached_ps(), 2 * period_ps);
}

TEST_F(ReleaseOfTwo, OneThatLacksTimesIsALossAsAWhole) {
  release.add({2, {{7}, {}}, true}, now);
  release.flush();
  EXPECT_THAT(
      sink.tags,
      ElementsAre(loss(TagKind::loss_begin, 2 * period_ps), photon_tag(2 * period_ps + 7, 1),
                  loss(TagKind::loss_end, 3 * period_ps), heartbeat_tag(3 * period_ps)));
}

// As they came, a slack later.
TEST_F(ReleaseOfTwo, TagsComeAsTheTimePasses) {
  release.add({0, {{10 * ps_a_ms, 150 * ps_a_ms}, {}}, false}, now);
  release.run(now + Release::slack);
  EXPECT_TRUE(sink.tags.empty());
  release.run(now + Release::slack + milliseconds{11});
  EXPECT_THAT(sink.tags, ElementsAre(photon_tag(10 * ps_a_ms, 1), heartbeat_tag(11 * ps_a_ms)));
  sink.tags.clear();
  // The next may be later by the slack.
  const auto later = now + milliseconds{200} + Release::slack - milliseconds{1};
  release.add({1, {{}, {}}, false}, later);
  release.run(later + milliseconds{3});
  EXPECT_THAT(sink.tags,
              ElementsAre(photon_tag(150 * ps_a_ms, 1), loss(TagKind::loss_begin, 200 * ps_a_ms),
                          loss(TagKind::loss_end, period_ps), heartbeat_tag(period_ps),
                          heartbeat_tag(202 * ps_a_ms)));
}

TEST_F(ReleaseOfTwo, OneThatIsLaterSetsTheTimeAnew) {
  release.add({0, {{}, {}}, false}, now);
  const auto later = now + milliseconds{300};
  release.add({1, {{}, {}}, false}, later);
  release.run(later + Release::slack + milliseconds{1});
  EXPECT_EQ(release.reached_ps(), period_ps + ps_a_ms);
}

// And one that comes early too, so that no backlog grows.
TEST_F(ReleaseOfTwo, OneThatIsEarlySetsTheTimeAnew) {
  release.add({0, {{}, {}}, false}, now);
  const auto soon = now + milliseconds{140};
  release.add({1, {{}, {}}, false}, soon);
  release.run(soon + Release::slack + milliseconds{1});
  EXPECT_EQ(release.reached_ps(), period_ps + ps_a_ms);
}

// 64 bits of picoseconds last 106 days.
TEST_F(ReleaseOfTwo, TheClockBeginsAnewAfter53Days) {
  constexpr std::int64_t last = std::numeric_limits<std::int64_t>::max() / 2 / period_ps;
  release.add({last, {{7}, {}}, true}, now);
  release.add({last + 1, {{}, {9}}, true}, now + milliseconds{200});
  EXPECT_EQ(sink.tags.size(), 4U);  // all of the clock before
  release.run(now + milliseconds{200} + Release::slack + milliseconds{1});
  EXPECT_THAT(
      sink.tags,
      ElementsAre(loss(TagKind::loss_begin, last * period_ps), photon_tag(last * period_ps + 7, 1),
                  loss(TagKind::loss_end, (last + 1) * period_ps),
                  heartbeat_tag((last + 1) * period_ps),
                  Tag{(last + 1) * period_ps, 0, TagKind::clock_break, {}},
                  loss(TagKind::loss_begin, 0), photon_tag(9, 4), heartbeat_tag(ps_a_ms)));
}

}  // namespace
}  // namespace splid::idq
