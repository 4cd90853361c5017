#include "drivers/replay/loss_list.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace splid {
namespace {

std::vector<Tag> all(LossList list) {
  std::vector<Tag> tags;
  for (; list.next() != nullptr; list.take()) tags.push_back(*list.next());
  return tags;
}

Tag tag_at(std::int64_t time_ps, TagKind kind, int value = 0) { return {time_ps, value, kind, {}}; }

TEST(LossList, TellsOfLossesInTheOrderOfTime) {
  const std::vector<Loss> losses = {{10, 20, 3}, {15, 15, 2}, {20, 30, -1}};
  EXPECT_EQ(all(LossList(losses)),
            (std::vector<Tag>{tag_at(10, TagKind::loss_begin), tag_at(15, TagKind::missed, 2),
                              tag_at(20, TagKind::loss_end, 3), tag_at(20, TagKind::loss_begin),
                              tag_at(30, TagKind::loss_end, -1)}));
}

TEST(LossList, NoLossesAreNoTags) { EXPECT_EQ(LossList({}).next(), nullptr); }

TEST(LossList, CountsAreClippedToATagsValue) {
  const std::vector<Loss> losses = {{0, 5, 5'000'000'000}};
  EXPECT_EQ(all(LossList(losses))[1].value, std::numeric_limits<std::int32_t>::max());
}

}  // namespace
}  // namespace splid
