#include "drivers/usb/bulk_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "drivers/usb/usb_choice.hpp"
#include "drivers/usb/usb_context.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/usb_double.hpp"
#include "tests/support/usb_run.hpp"

// Transfers of an emulated kernel device: bytes that count from 0 to 255 and over again, so that
// a byte that is missing or comes twice shows.

namespace splid::usb {
namespace {

using test::comes_true;

constexpr std::size_t stall = 4;  // LIBUSB_TRANSFER_STALL

class BulkStreamTest : public ::testing::Test {
 protected:
  void SetUp() override {
    double_.plug();
    device = Choice({{{0x1209, 0x5a1d}}, ""}).open(context);
    ASSERT_NE(device, nullptr);
    stream.emplace(*device, 0x81, 1000, queue, counters, wake);
  }

  // The device sends so many bytes, and each comes, in order.
  bool comes_through(std::size_t wanted = 20'000) {
    to_send_ += wanted;
    std::vector<std::byte> bytes;
    const bool came = comes_true([&] {
      for (auto block = queue.front(); block; block = queue.front()) {
        bytes.insert(bytes.end(), block->bytes.begin(), block->bytes.end());
        queue.pop();
      }
      return bytes.size() >= wanted;
    });
    const auto is_no_step = [](std::byte a, std::byte b) {
      return (std::to_integer<int>(a) + 1) % 256 != std::to_integer<int>(b);
    };
    return came && bytes.size() == wanted &&
           std::ranges::adjacent_find(bytes, is_no_step) == bytes.end();
  }
  [[nodiscard]] bool comes_down() {
    return comes_true([&] { return double_.transfers_in_flight() == 0; });
  }

  int next_ = 0;
  std::atomic<std::size_t> to_send_{0};
  std::atomic<std::size_t> largest_room_{0};
  test::StreamFirmware firmware{[this](std::span<std::byte> room) {
    largest_room_ = std::max(largest_room_.load(), room.size());
    const std::size_t count = std::min(room.size(), to_send_.load());
    for (std::byte& byte : room.first(count)) byte = static_cast<std::byte>(next_++ % 256);
    to_send_ -= count;
    return count;
  }};
  test::UsbDouble double_{{{0x1209, 0x5a1d}, "A-7"}, firmware};
  Context context;
  EventThread events{context};
  std::unique_ptr<Device> device;
  BlockQueue queue{1 << 16};
  Counters counters;
  Wake wake;
  std::optional<BulkStream> stream;
};

TEST_F(BulkStreamTest, BytesComeInOrderUntilItIsStoppedAndAgainOnceItIsStarted) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(stream->start(8), 8U);
    EXPECT_TRUE(comes_through());
    EXPECT_TRUE(stream->stop());
    EXPECT_EQ(double_.transfers_in_flight(), 0U);
    EXPECT_EQ(stream->trouble(), BulkStream::none);
  }
  EXPECT_EQ(queue.cuts(), 0U);
  EXPECT_EQ(counters.bytes, 40'000U);
}

// Packets are of 512 bytes here: a device could send more than 1000 before it is told to stop.
TEST_F(BulkStreamTest, ATransferHasRoomForWholePackets) {
  EXPECT_EQ(stream->start(1), 1U);
  EXPECT_TRUE(comes_through());
  EXPECT_EQ(largest_room_, 1024U);
}

TEST_F(BulkStreamTest, AStallEndsAllTransfersAndIsOneCutUntilItIsCleared) {
  EXPECT_EQ(stream->start(8), 8U);
  EXPECT_TRUE(comes_through());
  firmware.fail(-EPIPE);
  ASSERT_TRUE(comes_true([&] { return counters.transfers.at(stall) == 8; }));
  EXPECT_EQ(stream->trouble(), BulkStream::stalled);
  EXPECT_EQ(stream->stalls(), 1U);
  EXPECT_EQ(queue.cuts(), 1U);
  ASSERT_TRUE(stream->stop());
  device->clear_halt(0x81);
  EXPECT_EQ(stream->start(8), 8U);
  EXPECT_EQ(stream->trouble(), BulkStream::none);
  EXPECT_TRUE(comes_through());
}

TEST_F(BulkStreamTest, AHundredFailuresInARowAndNoFewerEndIt) {
  EXPECT_EQ(stream->start(1), 1U);
  for (int i = 0; i < 2; ++i) {
    firmware.fail(-EOVERFLOW, BulkStream::max_failures - 1);
    EXPECT_TRUE(comes_through());
  }
  EXPECT_EQ(queue.cuts(), 2 * (BulkStream::max_failures - 1U));
  EXPECT_EQ(stream->trouble(), BulkStream::none);
  EXPECT_STREQ(stream->last_failure(), "overflow");
  firmware.fail(-EPROTO, BulkStream::max_failures);
  ASSERT_TRUE(comes_true([&] { return stream->trouble() == BulkStream::failing; }));
  EXPECT_TRUE(comes_down());
  EXPECT_STREQ(stream->last_failure(), "error");
}

TEST_F(BulkStreamTest, WhereTheKernelHasNoRoomHalfAsManyAreStarted) {
  double_.set_most_transfers(5);
  EXPECT_EQ(stream->start(16), 4U);
  EXPECT_TRUE(comes_through());
}

TEST_F(BulkStreamTest, AnUnpluggedDeviceIsGoneAndNothingIsWaitedFor) {
  EXPECT_EQ(stream->start(8), 8U);
  EXPECT_TRUE(comes_through());
  double_.unplug();
  EXPECT_TRUE(comes_true([&] { return (stream->trouble() & BulkStream::gone) != 0; }));
  EXPECT_TRUE(stream->stop());
}

TEST_F(BulkStreamTest, WhatTheQueueHasNoRoomForIsCountedAndACut) {
  EXPECT_EQ(stream->start(8), 8U);
  to_send_ = 2 << 16;
  EXPECT_TRUE(comes_true([&] { return counters.bytes == 2U << 16U; }));
  EXPECT_GE(counters.dropped_bytes, 1U << 16U);
  EXPECT_GT(queue.cuts(), 0U);
  EXPECT_EQ(stream->trouble(), BulkStream::none);
}

}  // namespace
}  // namespace splid::usb
