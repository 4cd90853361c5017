#include <gtest/gtest.h>

#include "estimator/sync/sync_survey.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/sync_stream.hpp"

namespace splid {
namespace {

using test::SyncStream;

void expect_period(const SyncStream& stream, double tolerance_ps) {
  const std::optional<double> found = find_sync_period_ps(stream.make());
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, stream.period_ps, tolerance_ps);
}

TEST(PeriodFromGaps, OfACleanStream) {
  SyncStream stream;
  stream.period_ps = 3'770'000;
  expect_period(stream, 1);
}

TEST(PeriodFromGaps, WithJitter) {
  for (const double jitter_ps : {0.0, 10.0, 100.0, 500.0}) {
    SyncStream stream;
    stream.period_ps = 3'770'000;
    stream.jitter_ps = jitter_ps;
    expect_period(stream, 0.05 * jitter_ps + 1);
  }
}

TEST(PeriodFromGaps, WhereMostSyncsAreLeftOut) {
  for (const double missing : {0.3, 0.9, 0.98}) {
    for (std::uint64_t seed = 1; seed < 6; ++seed) {
      SyncStream stream;
      stream.period_ps = 3'770'000;
      stream.missing = missing;
      stream.seed = seed;
      stream.end_ps = 500'000'000'000;
      expect_period(stream, 2);
    }
  }
}

TEST(PeriodFromGaps, WithStraysAndMissingOnes) {
  SyncStream stream;
  stream.period_ps = 3'770'000;
  stream.missing = 0.2;
  stream.strays = 0.02;
  expect_period(stream, 2);
}

TEST(PeriodFromGaps, NoneFitsRandomTags) {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    SyncStream stream;
    stream.missing = 1;
    stream.strays = 1;
    stream.seed = seed;
    EXPECT_FALSE(find_sync_period_ps(stream.make())) << seed;
  }
}

TEST(PeriodFromGaps, TooFewSyncs) {
  EXPECT_FALSE(find_sync_period_ps({}));
  const std::vector<std::int64_t> few = {0, 100, 200, 300, 400, 500, 600, 700};
  EXPECT_FALSE(find_sync_period_ps(few));
}

TEST(PeriodFromGaps, EpochFarFromZero) {
  SyncStream stream;
  stream.begin_ps = 340'000'000'000'000'000;
  stream.end_ps = stream.begin_ps + 10'000'000'000;
  expect_period(stream, 1);
}

TEST(PeriodFromGaps, OfARealTaggerThatKeepsSyncsNextToPhotons) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here; set SPLID_DATA";
  std::vector<std::int64_t> syncs;
  for (const Tag& tag : test::ptu_tags(file)) {
    if (tag.kind == TagKind::sync) syncs.push_back(tag.time_ps);
  }
  for (std::size_t first = 0; first < 100'000; first += 20'000) {
    const std::optional<double> found = find_sync_period_ps(std::span(syncs).subspan(first));
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, 12'512.626, 0.2);
  }
}

}  // namespace
}  // namespace splid
