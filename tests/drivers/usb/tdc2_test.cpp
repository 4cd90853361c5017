#include "drivers/usb/tdc2.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <random>
#include <vector>

#include "tests/support/tdc2_firmware.hpp"
#include "tests/support/usb_double.hpp"
#include "tests/support/usb_run.hpp"

namespace splid::usb {
namespace {

using test::comes_true;
using test::Tdc2Faults;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Tdc2OnDouble : public ::testing::Test {
 protected:
  static Tdc2Options options() {
    Tdc2Options chosen;
    chosen.usb.transfers = 8;
    chosen.usb.transfer_kib = 16;
    return chosen;
  }
  static bool goes_on(const test::SourceRun& run) {
    const std::size_t before = run.photons();
    return comes_true([&] { return run.photons() > before + 1000; });
  }
  // Plugged in with a fault, it is not started, and the status says why.
  void expect_refusal(const Tdc2Faults& faults, const std::string& words) {
    firmware.set(faults);
    device.plug();
    test::SourceRun run(options());
    EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::failing, words); }));
    EXPECT_FALSE(firmware.streams());
    firmware.set({});
    EXPECT_TRUE(goes_on(run));  // it is tried again
    EXPECT_EQ(run.reports().back().state, DeviceState::connected);
  }

  test::Tdc2Firmware firmware;
  test::UsbDouble device{{{0x3137, 0x200a}, "TDC2-0042", {0x01, 0x81, 0x82}}, firmware};
};

TEST_F(Tdc2OnDouble, IsStartedAndStoppedByItsSequence) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  run.stop();
  EXPECT_THAT(firmware.complaints(), IsEmpty());
  EXPECT_THAT(firmware.commands(),
              ElementsAre(61, 85, 57, 66, 81, 81, 81, 81, 68, 68, 68, 68, 68, 68, 68, 68, 54, 64,
                          64, 54, 84, 54, 54, 55, 54, 57, 54));
  EXPECT_FALSE(firmware.streams());
  EXPECT_THAT(run.reports(), ElementsAre(DeviceReport{DeviceState::connected, "",
                                                      "3137:200a serial TDC2-0042 at 1-1", ""}));
}

// Times of 10 us steps; every tenth record has two inputs; dummies are heartbeats and no photons.
TEST_F(Tdc2OnDouble, RecordsBecomeTags) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  run.stop();
  std::int64_t expected_ps = 0;
  for (const Tag& tag : run.tags()) {
    if (tag.kind == TagKind::heartbeat) continue;
    ASSERT_EQ(tag.kind, TagKind::photon);
    if (tag.value == 4) {
      ASSERT_EQ(tag.time_ps, expected_ps - 10'000'000);
      ASSERT_EQ(tag.time_ps % 100'000'000, 0);
    } else {
      ASSERT_EQ(tag, photon_tag(expected_ps, 1));
      expected_ps += 10'000'000;
    }
  }
  EXPECT_GT(run.count(TagKind::heartbeat), 5U);
}

TEST_F(Tdc2OnDouble, ThresholdsAreSetByInput) {
  Tdc2Options chosen = options();
  chosen.thresholds_mv = {-1024, -448, 1000, 2047.25};
  device.plug();
  test::SourceRun run(chosen);
  ASSERT_TRUE(goes_on(run));
  EXPECT_THAT(firmware.thresholds(),
              ElementsAre(0x3000, 0x472D, 0x2300, 0x5B0E, 0x1A8B, 0x6B0E, 0x0FFF, 0x772D));
}

TEST_F(Tdc2OnDouble, ALostTableIsLoaded) {
  firmware.set({.table_lost = true});
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  EXPECT_THAT(firmware.commands(), ::testing::Contains(82));
  EXPECT_THAT(firmware.complaints(), IsEmpty());
}

TEST_F(Tdc2OnDouble, ATableThatDoesNotLoadIsSaid) {
  expect_refusal({.table_damaged = true}, "table does not load");
}

TEST_F(Tdc2OnDouble, DamagedParametersAreSaid) {
  expect_refusal({.parameters = {2, 0x8011, 0x0001, 0}}, "parameters in its EEPROM are damaged");
}

// Their sum is zero, as it should be, but there are 1 to 126.
TEST_F(Tdc2OnDouble, ACountOfParametersThatCannotBeIsSaid) {
  for (const std::vector<std::uint16_t>& none_or_many :
       {std::vector<std::uint16_t>{0, 0}, std::vector<std::uint16_t>{127, 0xFF81}}) {
    expect_refusal({.parameters = none_or_many}, "parameters in its EEPROM are damaged");
    device.unplug();
  }
}

// The second word is the output's; where there is none, or what more there is, is not written.
TEST_F(Tdc2OnDouble, ItsParametersAreWrittenBack) {
  firmware.set({.parameters = {1, 0x8011, 0x7FEE}});
  device.plug();
  test::SourceRun one(options());
  ASSERT_TRUE(goes_on(one));
  one.stop();
  EXPECT_THAT(firmware.parameters(), ElementsAre(0x8011, 0));
  firmware.set({.parameters = {126, 0xFF82}});
  test::SourceRun most(options());
  ASSERT_TRUE(goes_on(most));
  most.stop();
  firmware.set({});
  test::SourceRun two(options());
  ASSERT_TRUE(goes_on(two));
  EXPECT_THAT(firmware.parameters(), ElementsAre(0x8011, 0, 0xFF82, 0, 0x00018011, 0));
}

TEST_F(Tdc2OnDouble, ABusyOneIsSaid) { expect_refusal({.busy = true}, "it is busy"); }

TEST_F(Tdc2OnDouble, OneThatDoesNotAnswerIsSaid) { expect_refusal({.mute = true}, "no answer"); }

TEST_F(Tdc2OnDouble, OneThatStopsAnsweringIsOpenedAnew) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.set({.mute = true});
  EXPECT_TRUE(
      comes_true([&] { return run.said(DeviceState::failing, "does not answer any more"); }));
  EXPECT_EQ(firmware.unanswered_polls(), 4);
  EXPECT_EQ(run.count(TagKind::clock_break), 1U);
  firmware.set({});
  EXPECT_TRUE(goes_on(run));
}

TEST_F(Tdc2OnDouble, ABitOfTheStatusWordIsALoss) {
  firmware.set_status(0x10);  // up from the start: tells nothing
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
  firmware.set_status(0x14);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "0x00000014 says"); }));
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::loss_end) == 1; }));
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::loss_begin), 1U);
  run.stop();
  // From one look at the word to the next, which are 50 ms apart, and of unknown count. Photons are
  // 10 us apart: a loss that ended with the next of them would be that short.
  const std::vector<Tag> tags = run.tags();
  const Tag begin = *std::ranges::find(tags, TagKind::loss_begin, &Tag::kind);
  const Tag end = *std::ranges::find(tags, TagKind::loss_end, &Tag::kind);
  EXPECT_EQ(end.value, -1);
  EXPECT_GT(end.time_ps - begin.time_ps, 5'000'000'000);
}

TEST_F(Tdc2OnDouble, BitsThatMeanNothingAreLeftOut) {
  Tdc2Options chosen = options();
  chosen.loss_bits = 0x1;
  device.plug();
  test::SourceRun run(chosen);
  ASSERT_TRUE(goes_on(run));
  firmware.set_status(0xFFFFFFFF);  // cannot be read
  ASSERT_TRUE(goes_on(run));
  firmware.set_status(0x14);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
}

// Heartbeats go on by the host's clock, behind the instrument's, and no tag comes earlier.
TEST_F(Tdc2OnDouble, InTheDarkTimePasses) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.set_dark(true);
  const std::size_t before = run.count(TagKind::heartbeat);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::heartbeat) > before + 5; }));
  firmware.set_dark(false);
  ASSERT_TRUE(goes_on(run));
  run.stop();
  std::int64_t last_ps = 0;
  for (const Tag& tag : run.tags()) {
    ASSERT_GE(tag.time_ps, last_ps);
    last_ps = tag.time_ps;
  }
  EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
}

TEST_F(Tdc2OnDouble, GarbageIsMissedTagsAndNoTimes) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  std::mt19937 random(3);
  std::vector<std::byte> garbage(8 * 20 + 3);
  for (std::byte& byte : garbage) byte = static_cast<std::byte>(random());
  firmware.send(garbage);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::missed) == 21; }));
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "records are invalid"); }));
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::missed), 21U);
  EXPECT_EQ(run.count(TagKind::clock_break), 0U);
}

TEST_F(Tdc2OnDouble, MuchGarbageIsALossAndTheClockGoesOn) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  std::mt19937 random(3);
  for (int transfer = 0; transfer < 5; ++transfer) {
    std::vector<std::byte> garbage(16'384);
    for (std::byte& byte : garbage) byte = static_cast<std::byte>(random());
    const std::size_t before = run.count(TagKind::missed);
    firmware.send(garbage);
    ASSERT_TRUE(comes_true([&] { return run.count(TagKind::missed) > before + 2000; }));
  }
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::clock_break), 0U);
  EXPECT_GE(run.count(TagKind::loss_begin), 1U);
  EXPECT_EQ(run.count(TagKind::loss_end), run.count(TagKind::loss_begin));
}

TEST_F(Tdc2OnDouble, RecordsThatSlippedAreAlignedByOpeningItAnew) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.slip(3);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::failing, "incomplete records"); }));
  EXPECT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::clock_break), 1U);
}

TEST_F(Tdc2OnDouble, AStatusWordThatCannotBeReadIsSaid) {
  firmware.set_status(0xFFFFFFFF);
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  EXPECT_TRUE(
      comes_true([&] { return run.said(DeviceState::connected, "whether it loses tags"); }));
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::missed) > 2; }));
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 0U);
  firmware.set_status(0);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "can be read again"); }));
}

TEST_F(Tdc2OnDouble, OneWhoseStatusWordIsGoneIsOpenedAnew) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.set_status(0xFFFFFFFF);
  EXPECT_TRUE(
      comes_true([&] { return run.said(DeviceState::failing, "cannot be read any more"); }));
  // From the 20th reading on each is a loss of unknown count; the 40th is the last.
  EXPECT_EQ(run.count(TagKind::missed), 20U);
  EXPECT_EQ(run.count(TagKind::loss_begin), 1U);  // with which its clock ends
  EXPECT_TRUE(goes_on(run));
}

TEST_F(Tdc2OnDouble, UnpluggedAndPluggedInAgain) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.unplug();
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "TDC2-0042"); }));
  device.plug();
  EXPECT_TRUE(goes_on(run));
  EXPECT_EQ(run.count(TagKind::clock_break), 1U);
  EXPECT_THAT(firmware.complaints(), IsEmpty());
}

// Whichever transfer meets the pulled cable first, the sentence is the same.
TEST_F(Tdc2OnDouble, UnpluggedIsSaidWhereACommandMeetsItFirst) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.fail_writes(-ENODEV);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "it was unplugged"); }));
  EXPECT_FALSE(run.said(DeviceState::no_device, "cannot write"));
}

// A transfer breaks on the cable before the kernel knows that the device is gone. The source is
// held while it waits whether the device goes.
TEST_F(Tdc2OnDouble, UnpluggedIsSaidWhereACommandBreaksFirst) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  run.block_after_clock_breaks();
  device.fail_writes(-EPROTO);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::clock_break) == 1; }));
  device.unplug();
  run.block(false);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "it was unplugged"); }));
  EXPECT_FALSE(run.said(DeviceState::failing, ""));
}

// The device is there all the time, so that the command is what failed.
TEST_F(Tdc2OnDouble, ACommandThatBreaksOnADeviceThatStaysIsSaid) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.fail_writes(-EPROTO);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::failing, "TDC2-0042"); }));
  EXPECT_FALSE(run.said(DeviceState::no_device, ""));
}

}  // namespace
}  // namespace splid::usb
