#include "drivers/usb/ttm.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <map>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include "tests/support/stream_firmware.hpp"
#include "tests/support/ttm_sender.hpp"
#include "tests/support/usb_double.hpp"
#include "tests/support/usb_run.hpp"

// The driver against an emulated kernel device that sends a BrightEyes-TTM's records.

namespace splid::usb {
namespace {

using test::comes_true;
using test::TtmEvent;

constexpr std::int64_t gap_ps = 50'000'000;
constexpr std::int64_t line_ps = 20 * gap_ps;

// A photon every 50 us, on one input after the other, and the laser 50 ns after it. A line begins
// every millisecond, and a frame with each tenth.
std::vector<TtmEvent> steady_events(std::int64_t begin_ps, std::int64_t end_ps) {
  std::vector<TtmEvent> events;
  for (std::int64_t at_ps = begin_ps; at_ps < end_ps; at_ps += gap_ps) {
    events.push_back({at_ps + 1'000'000, static_cast<int>(at_ps / gap_ps % 25)});
    events.push_back({at_ps + 1'050'000, TtmEvent::laser});
    if (at_ps % line_ps == 0) events.push_back({at_ps + 2'000'000, TtmEvent::line});
    if (at_ps % (10 * line_ps) == 0) events.push_back({at_ps + 2'000'000, TtmEvent::frame});
    events.push_back({at_ps + 3'000'000, TtmEvent::pixel});
  }
  return events;
}

class TtmOnDouble : public ::testing::Test {
 protected:
  static TtmOptions options() {
    TtmOptions chosen;
    chosen.usb.transfers = 8;
    chosen.usb.transfer_kib = 16;
    return chosen;
  }
  static bool goes_on(const test::SourceRun& run, std::size_t more = 1000) {
    const std::size_t before = run.photons();
    return comes_true([&] { return run.photons() > before + more; });
  }
  // Nothing but one loss of unknown count, which is over.
  static void expect_one_loss(const test::SourceRun& run) {
    EXPECT_EQ(run.count(TagKind::loss_begin), 1U);
    EXPECT_EQ(run.count(TagKind::loss_end), 1U);
    EXPECT_EQ(run.count(TagKind::clock_break), 0U);
  }

  test::TtmSender sender{steady_events};
  test::StreamFirmware firmware{[this](std::span<std::byte> room) { return sender(room); }};
  test::UsbDouble device{{{0x04b4, 0x00f1}, "TTM-5"}, firmware};
};

// To the resolution of an uncalibrated tap of 32 or 64 ps that counts as 48.
TEST_F(TtmOnDouble, RecordsBecomeTags) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run, 3000));
  run.stop();
  std::int64_t expected = -1;  // of the next photon, in gaps; a stream begins anywhere
  std::map<int, std::size_t> markers;
  for (const Tag& tag : run.tags()) {
    const std::int64_t gap = tag.time_ps / gap_ps;
    const std::int64_t within_ps = tag.time_ps % gap_ps;
    if (tag.kind == TagKind::photon) {
      if (expected < 0) expected = gap;
      ASSERT_EQ(gap, expected++);
      ASSERT_EQ(tag.value, gap % 25);
      ASSERT_NEAR(static_cast<double>(within_ps), 1'000'000, 41);
    } else if (tag.kind == TagKind::sync) {
      if (expected < 0) continue;  // of the photon that was not sent any more
      ASSERT_EQ(gap, expected - 1);
      ASSERT_NEAR(static_cast<double>(within_ps), 1'050'000, 41);
    } else if (tag.kind == TagKind::marker) {
      ++markers[tag.value];
      const bool begins_line = tag.value >= 2;
      ASSERT_NEAR(static_cast<double>(within_ps), begins_line ? 2'000'000 : 3'000'000, 4'167);
      ASSERT_EQ(tag.value, !begins_line ? 1 : gap % 200 == 0 ? 6 : 2);
    } else {
      ASSERT_EQ(tag.kind, TagKind::heartbeat);
    }
  }
  EXPECT_GT(run.count(TagKind::sync), 2000U);
  EXPECT_GT(markers[1], 2000U);
  EXPECT_GT(markers[2], 20U);
  EXPECT_GT(markers[6], 2U);
  EXPECT_EQ(run.reports().front(),
            (DeviceReport{DeviceState::connected, "", "04b4:00f1 serial TTM-5 at 1-1", ""}));
}

TEST_F(TtmOnDouble, RecordsMayBeCutBetweenTransfers) {
  firmware.set_most_bytes(38);
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
}

TEST_F(TtmOnDouble, PhotonsThatItDropsAreALossAndSaid) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  sender.set_drops(true);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "it dropped photons"); }));
  const std::size_t markers = run.count(TagKind::marker);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::marker) > markers + 100; }));
  EXPECT_EQ(run.count(TagKind::loss_end), 0U);
  sender.set_drops(false);
  ASSERT_TRUE(goes_on(run));
  expect_one_loss(run);
}

TEST_F(TtmOnDouble, MissingRecordsAreALossAndSaid) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  sender.skip(3);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "records are missing"); }));
  ASSERT_TRUE(goes_on(run));
  expect_one_loss(run);
  run.stop();
  const std::vector<Tag> tags = run.tags();
  const auto begin = std::ranges::find(tags, TagKind::loss_begin, &Tag::kind);
  const auto end = std::ranges::find(tags, TagKind::loss_end, &Tag::kind);
  EXPECT_NEAR(static_cast<double>(end->time_ps - begin->time_ps), 3e9, 2e7);
}

// A byte is missing, so that others may be.
TEST_F(TtmOnDouble, HalfAWordIsALoss) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.send({std::byte{0x7F}});
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::loss_end) == 1; }));
  expect_one_loss(run);
}

TEST_F(TtmOnDouble, GarbageIsALossAndSaid) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  std::mt19937 random(3);
  std::vector<std::byte> garbage(5003);
  for (std::byte& byte : garbage) byte = static_cast<std::byte>(random());
  firmware.send(garbage);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "none that can be"); }));
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::clock_break), 0U);
  EXPECT_EQ(run.count(TagKind::loss_begin), run.count(TagKind::loss_end));
  EXPECT_GE(run.count(TagKind::loss_begin), 1U);
}

TEST_F(TtmOnDouble, AFailedTransferIsALossAndSaid) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.fail(-EPROTO);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "tags were lost in"); }));
  ASSERT_TRUE(goes_on(run));
  expect_one_loss(run);
}

TEST_F(TtmOnDouble, OneThatSendsNoRecordsIsOpenedAnew) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  sender.set_pads(true);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::failing, "no records"); }));
  sender.set_pads(false);
  EXPECT_TRUE(goes_on(run));
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 1U);
}

// Its count wraps in 0.56 s. Silence alone loses nothing: what follows may have waited in the
// device.
TEST_F(TtmOnDouble, AGapAfterASilenceEndsItsClock) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  for (const int missing_ms : {0, 600}) {
    firmware.set_silent(true);
    std::this_thread::sleep_for(std::chrono::milliseconds{300});
    if (missing_ms > 0) sender.skip(missing_ms);
    firmware.set_silent(false);
    ASSERT_TRUE(goes_on(run));
    EXPECT_EQ(run.count(TagKind::clock_break), missing_ms == 0 ? 0U : 1U);
  }
  EXPECT_TRUE(run.said(DeviceState::failing, "it sends nothing"));
  EXPECT_TRUE(run.said(DeviceState::connected, "it sent nothing for"));
}

TEST_F(TtmOnDouble, UnpluggedAndPluggedInAgain) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.unplug();
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "it was unplugged"); }));
  sender.restart();
  device.plug();
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::clock_break), 1U);
}

TEST_F(TtmOnDouble, AnotherSerialNumberIsNotTaken) {
  device.plug();
  TtmOptions other = options();
  other.usb.serial = "TTM-6";
  test::SourceRun run(other);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "with serial TTM-6"); }));
  EXPECT_EQ(run.photons(), 0U);
}

}  // namespace
}  // namespace splid::usb
