#include "drivers/usb/block_queue.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <thread>
#include <vector>

namespace splid::usb {
namespace {

std::vector<std::byte> bytes_of(std::size_t count, int value) {
  return std::vector<std::byte>(count, static_cast<std::byte>(value));
}

TEST(BlockQueue, BlocksComeOutWhole) {
  BlockQueue queue(1024);
  EXPECT_FALSE(queue.front().has_value());
  for (int round = 0; round < 50; ++round) {  // many times around the ring
    ASSERT_TRUE(queue.push(bytes_of(300, round)));
    ASSERT_TRUE(queue.push(bytes_of(0, 0)));
    const auto block = queue.front();
    ASSERT_TRUE(block.has_value());
    ASSERT_EQ(std::vector(block->bytes.begin(), block->bytes.end()), bytes_of(300, round));
    queue.pop();
    ASSERT_TRUE(queue.front()->bytes.empty());
    queue.pop();
    ASSERT_FALSE(queue.front().has_value());
  }
}

TEST(BlockQueue, WhatDoesNotFitIsACut) {
  BlockQueue queue(256);
  EXPECT_TRUE(queue.push(bytes_of(120, 1)));  // with its header 128
  EXPECT_FALSE(queue.push(bytes_of(121, 2)));
  EXPECT_EQ(queue.cuts(), 1U);
  EXPECT_TRUE(queue.push(bytes_of(120, 3)));
  EXPECT_EQ(queue.front()->cuts, 0U);
  queue.pop();
  EXPECT_EQ(queue.front()->cuts, 1U);
  queue.cut();
  EXPECT_EQ(queue.front()->cuts, 1U);
  EXPECT_EQ(queue.cuts(), 2U);
  EXPECT_EQ(queue.drops(), 1U);
}

// Two threads; the content shows each block whole and each lost one as a cut.
TEST(BlockQueue, NothingIsLostBetweenThreads) {
  constexpr std::uint32_t count = 200'000;
  BlockQueue queue(1 << 14);
  std::jthread producer([&] {
    for (std::uint32_t i = 0; i < count; ++i) {
      std::vector<std::byte> block(4 + i % 97, static_cast<std::byte>(i));
      std::memcpy(block.data(), &i, sizeof i);
      queue.push(block);
    }
    const std::uint32_t last = count;
    std::byte end[4];
    std::memcpy(end, &last, sizeof last);
    while (!queue.push(end)) std::this_thread::yield();
  });
  std::uint32_t next = 0;
  std::uint32_t cuts = 0;
  while (next <= count) {
    const auto block = queue.front();
    if (!block) continue;
    std::uint32_t number = 0;
    std::memcpy(&number, block->bytes.data(), sizeof number);
    if (number != count) {
      // One cut for each block that is missing.
      ASSERT_EQ(number - next, block->cuts - cuts);
      ASSERT_EQ(block->bytes.size(), 4 + number % 97);
      if (block->bytes.size() > 4) {
        ASSERT_EQ(block->bytes.back(), static_cast<std::byte>(number));
      }
    }
    cuts = block->cuts;
    next = number + 1;
    queue.pop();
  }
}

}  // namespace
}  // namespace splid::usb
