#include "daemon/commands/tag_census.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace splid {
namespace {

using ::testing::ElementsAre;

std::vector<Tag> every(std::int64_t period_ps, int input, int count) {
  std::vector<Tag> tags;
  for (int i = 0; i < count; ++i) tags.push_back(photon_tag(i * period_ps, input));
  return tags;
}

TEST(TagCensus, NothingHasNoChannelsAndNoSync) {
  const TagCensus census;
  EXPECT_TRUE(census.channels().empty());
  EXPECT_EQ(census.sync(), "");
  EXPECT_TRUE(census.photons().empty());
}

TEST(TagCensus, TheRegularInputOfTheLongestPeriodIsTheSync) {
  TagCensus census;
  census.count(every(1'000'000, 2, 1000));
  census.count(every(10'000'000, 4, 100));
  std::vector<Tag> irregular;
  for (std::int64_t i = 0; i < 200; ++i) irregular.push_back(photon_tag(i * i * 1000, 1));
  census.count(irregular);
  EXPECT_EQ(census.sync(), "4");
  EXPECT_THAT(census.photons(), ElementsAre("1", "2"));
  EXPECT_EQ(census.channels().at("4").period_ps, 10'000'000);
  EXPECT_EQ(census.channels().at("2").tags, 1000U);
  EXPECT_FALSE(census.channels().at("1").period_ps);
}

TEST(TagCensus, TooFewTagsAreNotRegular) {
  TagCensus census;
  census.count(every(1'000'000, 2, 99));
  EXPECT_EQ(census.sync(), "");
}

// One gap of ten may be another: a sync is missing here and there.
TEST(TagCensus, AMissingSyncLeavesItsPeriod) {
  std::vector<Tag> tags = every(1'000'000, 3, 1000);
  for (std::size_t i = 50; i < 900; i += 40) tags.erase(tags.begin() + static_cast<long>(i));
  TagCensus census;
  census.count(tags);
  EXPECT_EQ(census.channels().at("3").period_ps, 1'000'000);
}

TEST(TagCensus, AnInstrumentsOwnSyncsAreTheSync) {
  TagCensus census;
  census.count(every(1'000'000, 2, 1000));
  census.count(std::vector<Tag>{sync_tag(5), marker_tag(7, 2)});
  EXPECT_EQ(census.sync(), "sync");
  EXPECT_THAT(census.photons(), ElementsAre("2"));
  EXPECT_EQ(census.channels().at("marker:2").tags, 1U);
}

// As a BrightEyes-TTM and some PicoQuant instruments send them.
TEST(TagCensus, SyncsBesidePhotonsAloneHaveTheirPeriod) {
  std::mt19937 random(3);
  std::exponential_distribution<double> periods(1 / 200.0);
  std::normal_distribution<double> jitter_ps(0, 50);
  std::vector<Tag> syncs;
  double period = 0;
  for (int i = 0; i < 20'000; ++i) {
    period += 1 + std::floor(periods(random));
    syncs.push_back(sync_tag(std::llround(period * 12'512.626 + jitter_ps(random))));
  }
  TagCensus census;
  census.count(syncs);
  EXPECT_NEAR(census.channels().at("sync").period_ps.value_or(0), 12'512.626, 1e-3);
}

TEST(TagCensus, SyncsAtAnyTimeHaveNoPeriod) {
  std::mt19937 random(4);
  std::exponential_distribution<double> gap_ps(1e-6);
  std::vector<Tag> syncs;
  double at_ps = 0;
  for (int i = 0; i < 1000; ++i) {
    at_ps += 50'000 + gap_ps(random);
    syncs.push_back(sync_tag(std::llround(at_ps)));
  }
  TagCensus census;
  census.count(syncs);
  EXPECT_FALSE(census.channels().at("sync").period_ps);
}

TEST(TagCensus, LossesCount) {
  TagCensus census;
  census.count(std::vector<Tag>{{5, 0, TagKind::loss_begin, {}},
                                {9, 70, TagKind::loss_end, {}},
                                {20, 0, TagKind::loss_begin, {}},
                                {30, -1, TagKind::loss_end, {}},
                                {40, 3, TagKind::missed, {}},
                                heartbeat_tag(50)});
  EXPECT_EQ(census.losses(), 3U);
  EXPECT_EQ(census.lost_tags(), 73U);
  EXPECT_TRUE(census.channels().empty());
}

// One sync came twice.
TEST(TagCensus, SyncsOfOneTimeLeaveThePeriod) {
  std::vector<Tag> syncs;
  std::int64_t time_ps = 0;
  for (int i = 0; i < 1000; ++i) {
    time_ps += 3'780'000 * (1 + i * 7919 % 5);
    syncs.push_back(sync_tag(time_ps));
    if (i == 500) syncs.push_back(sync_tag(time_ps));
  }
  TagCensus census;
  census.count(syncs);
  EXPECT_EQ(census.channels().at("sync").period_ps, 3'780'000);
}

}  // namespace
}  // namespace splid
