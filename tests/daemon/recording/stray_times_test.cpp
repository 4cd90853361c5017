#include "daemon/recording/stray_times.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "daemon/recording/record_source.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/scripted_source.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::recording {
namespace {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

constexpr std::int64_t second_ps = 1'000'000'000'000;

// What comes of a stream, however it is cut into pieces.
std::vector<Tag> sorted_out(StrayTimes& times, const std::vector<Tag>& tags, std::size_t piece) {
  std::vector<Tag> kept;
  std::span<const Tag> left = tags;
  while (!left.empty()) {
    const std::size_t count = std::min(piece, left.size());
    const std::span<const Tag> some = times.sort_out(left.first(count));
    kept.insert(kept.end(), some.begin(), some.end());
    left = left.subspan(count);
  }
  const std::span<const Tag> last = times.finish();
  kept.insert(kept.end(), last.begin(), last.end());
  return kept;
}

void expect_kept(const std::vector<Tag>& tags, const std::vector<Tag>& expected,
                 std::uint64_t strays) {
  for (const std::size_t piece : {1, 2, 3, 100}) {
    StrayTimes times;
    EXPECT_THAT(sorted_out(times, tags, piece), ElementsAreArray(expected)) << piece;
    EXPECT_EQ(times.strays(), strays) << piece;
  }
}

TEST(StrayTimes, OneTagFarAheadIsMissed) {
  for (const std::int64_t ahead_ps : {second_ps + 1, 3600 * second_ps, 1'000'000 * second_ps,
                                      std::numeric_limits<std::int64_t>::max() - 10}) {
    expect_kept({photon_tag(10, 1), photon_tag(10 + ahead_ps, 1), sync_tag(20), photon_tag(30, 1)},
                {photon_tag(10, 1), {11, 1, TagKind::missed, {}}, sync_tag(20), photon_tag(30, 1)},
                1);
  }
}

TEST(StrayTimes, AHeartbeatFarAheadIsNoTagThatIsLost) {
  expect_kept({photon_tag(10, 1), heartbeat_tag(5 * second_ps), photon_tag(20, 1)},
              {photon_tag(10, 1), photon_tag(20, 1)}, 0);
}

TEST(StrayTimes, AfterAPauseNothingIsMissed) {
  const std::vector<Tag> tags = {
      photon_tag(0, 1),
      photon_tag(5 * second_ps + 1'000'000, 1),
      sync_tag(5 * second_ps),  // out of order by 1 us
      photon_tag(9 * second_ps, 1),
      photon_tag(12 * second_ps, 1),
      {20 * second_ps, 0, TagKind::loss_begin, {}},
      {30 * second_ps, 7, TagKind::loss_end, {}},
      photon_tag(30 * second_ps + 5, 1),
      photon_tag(40 * second_ps, 1),
      {0, 0, TagKind::clock_break, {}},
      photon_tag(7, 1),
      heartbeat_tag(3 * second_ps),
      photon_tag(50 * second_ps, 1),
  };
  expect_kept(tags, tags, 0);
}

TEST(StrayTimes, TwoStraysThatDoNotAgreeAreMissed) {
  expect_kept({photon_tag(10, 1), photon_tag(8 * second_ps, 1), photon_tag(5 * second_ps, 1),
               photon_tag(20, 1)},
              {photon_tag(10, 1),
               {11, 1, TagKind::missed, {}},
               {11, 1, TagKind::missed, {}},
               photon_tag(20, 1)},
              2);
}

// As after two stray times that agree, and where an instrument does not tell that its clock was
// set.
TEST(StrayTimes, SixteenTagsFarBehindAreAClockThatWasSetBack) {
  std::vector<Tag> tags = {photon_tag(10, 1), photon_tag(5 * second_ps, 1),
                           photon_tag(5 * second_ps + 1, 1)};
  for (std::int64_t i = 0; i < 20; ++i) tags.push_back(photon_tag(20 + i, 1));
  std::vector<Tag> expected = tags;
  expected.insert(expected.begin() + 3 + 15, {35, 0, TagKind::clock_break, {}});
  expect_kept(tags, expected, 0);
}

TEST(StrayTimes, FewTagsFarBehindAreOnlyLate) {
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < 100; ++i) {
    tags.push_back(photon_tag((i % 16 == 0 ? 5 : 1) * second_ps + i, 1));
  }
  expect_kept(tags, tags, 0);
}

// `splid record`: neither the rest of the file nor the time that was asked for is lost.
TEST(RecordSource, OneTagFarAheadCostsThatTagAlone) {
  const splid::test::TempFolder folder;
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < 1000; ++i) tags.push_back(photon_tag(i * 10'000'000'000, 1));
  std::vector<Tag> with_stray = tags;
  with_stray.insert(with_stray.begin() + 500, photon_tag(3600 * second_ps, 1));
  Limit limit;
  limit.seconds = 9.98;
  ScriptedSource source(with_stray, SourceInfo{"script", false, {}});
  const std::string file = folder.path("one.ptu");
  const RecordSummary summary =
      record_source(scene_config(0), source, file, false, host_clock(), {}, limit);
  EXPECT_THAT(splid::test::read_back(file), ElementsAreArray(tags));
  EXPECT_EQ(summary.lost_tags, 1U);
  EXPECT_DOUBLE_EQ(summary.seconds, 9.99);
  EXPECT_THAT(in_words(summary, file),
              HasSubstr("1 tags lost; 1 tags had a time far ahead of all others"));
}

}  // namespace
}  // namespace splid::recording
