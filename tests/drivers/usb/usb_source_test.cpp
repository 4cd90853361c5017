#include "drivers/usb/usb_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "drivers/usb/tags16_usb.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/scene_records.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/tags16_sender.hpp"
#include "tests/support/usb_double.hpp"
#include "tests/support/usb_run.hpp"
#include "tests/support/yardstick.hpp"

// The engine against an emulated kernel device that sends tags16 blocks: streaming, and everything
// that can happen to a device.

namespace splid::usb {
namespace {

using test::comes_true;

// Photons are 10 us apart: where some are missing, a loss or a new clock is reported in between.
::testing::AssertionResult every_gap_is_said(const std::vector<Tag>& tags) {
  std::int64_t last_ps = -1;
  bool said = true;
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::photon) {
      const std::int64_t gap_ps = tag.time_ps - last_ps;
      if (!said && gap_ps != test::steady_gap_ps) {
        return ::testing::AssertionFailure()
               << "from " << last_ps << " to " << tag.time_ps << " ps without a word";
      }
      last_ps = tag.time_ps;
      said = false;
    } else if (tag.kind != TagKind::heartbeat) {
      said = true;
    }
  }
  return ::testing::AssertionSuccess();
}

// Open files of this process, but for those of the double's connections: local sockets, and the
// eventfds of GLib's main contexts. umockdev leaves one of either behind where a device vanishes
// while it is opened, as happens on a busy machine. A context of libusb has a timerfd too, and a
// device its node.
std::size_t open_files() {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    int domain = AF_UNSPEC;
    socklen_t length = sizeof domain;
    const int file = std::stoi(entry.path().filename().string());
    getsockopt(file, SOL_SOCKET, SO_DOMAIN, &domain, &length);
    std::error_code gone;
    const bool is_event =
        std::filesystem::read_symlink(entry.path(), gone) == "anon_inode:[eventfd]";
    count += domain == AF_UNIX || is_event ? 0 : 1;
  }
  return count;
}

class UsbSourceOnDouble : public ::testing::Test {
 protected:
  static Tags16Options options() {
    Tags16Options chosen;
    chosen.usb_id = "1209:5a1d";
    chosen.usb.transfers = 8;
    chosen.usb.transfer_kib = 64;
    return chosen;
  }

  // More photons come than there are.
  static bool goes_on(const test::SourceRun& run, std::size_t more = 1000) {
    const std::size_t before = run.photons();
    return comes_true([&] { return run.photons() > before + more; });
  }

  test::Tags16Sender sender{test::steady_records};
  test::StreamFirmware firmware{[this](std::span<std::byte> room) { return sender(room); }};
  test::UsbDouble device{{{0x1209, 0x5a1d}, "A-7"}, firmware};
};

TEST_F(UsbSourceOnDouble, StreamsWithoutAnyLoss) {
  device.plug();
  test::SourceRun run(options());
  EXPECT_TRUE(goes_on(run, 5000));
  EXPECT_TRUE(comes_true([&] { return device.transfers_in_flight() == 8; }));
  run.stop();
  EXPECT_EQ(device.transfers_in_flight(), 0U);
  EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
  EXPECT_TRUE(every_gap_is_said(run.tags()));
  EXPECT_THAT(run.reports(), ::testing::ElementsAre(DeviceReport{
                                 DeviceState::connected, "", "1209:5a1d serial A-7 at 1-1", ""}));
  EXPECT_GE(run.counter("splid_usb_bytes_total"), 5000 * 16U);
  EXPECT_GE(run.counter("splid_tags16_bytes_total"), 5000 * 16U);
  EXPECT_GE(run.counter("splid_tags16_blocks_total"), 1U);
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 0U);
}

TEST_F(UsbSourceOnDouble, WaitsForADeviceWithTheSerialAskedFor) {
  device.plug();
  Tags16Options other = options();
  other.usb.serial = "A-8";
  test::SourceRun none(other);
  EXPECT_TRUE(comes_true([&] { return none.said(DeviceState::no_device, "with serial A-8"); }));
  none.stop();
  EXPECT_EQ(none.reports().size(), 1U);  // said once, however long it waits
  Tags16Options right = options();
  right.usb.serial = "A-7";
  test::SourceRun run(right);
  EXPECT_TRUE(goes_on(run));
}

TEST_F(UsbSourceOnDouble, StartsWhenTheDeviceIsPluggedIn) {
  test::SourceRun run(options());
  EXPECT_TRUE(comes_true(
      [&] { return run.said(DeviceState::no_device, "no USB device 1209:5a1d is plugged in"); }));
  device.plug();
  EXPECT_TRUE(goes_on(run));
}

TEST_F(UsbSourceOnDouble, AnEndpointThatItDoesNotHaveIsAnError) {
  device.plug();
  Tags16Options wrong = options();
  wrong.endpoint = "0x85";
  test::SourceRun run(wrong);
  ASSERT_TRUE(comes_true([&] { return run.error().has_value(); }));
  EXPECT_EQ(run.error()->fault(), Fault::usage);
  EXPECT_THAT(run.error()->what(), ::testing::HasSubstr("no bulk endpoint 0x85; it has 0x81"));
}

// libusb would only say LIBUSB_ERROR_IO.
TEST_F(UsbSourceOnDouble, AnEndpointOfAnotherAlternateSettingIsAnError) {
  test::UsbDouble two_settings{{{0x1209, 0x5a1d}, "A-8", {0x81}, 480, {0x82}}, firmware, device};
  two_settings.plug();
  Tags16Options wrong = options();
  wrong.endpoint = "0x82";
  test::SourceRun run(wrong);
  ASSERT_TRUE(comes_true([&] { return run.error().has_value(); }));
  EXPECT_EQ(run.error()->fault(), Fault::usage);
  EXPECT_THAT(run.error()->what(),
              ::testing::AllOf(::testing::HasSubstr("endpoint 0x82 belongs to alternate setting 1"),
                               ::testing::HasSubstr("set source.alternate_setting to 1")));
  wrong.alternate_setting = 1;
  test::SourceRun right(wrong);
  EXPECT_TRUE(goes_on(right));
}

class TwoUsbDevices : public UsbSourceOnDouble {
 protected:
  test::UsbDouble second{{{0x1209, 0x5a1d}, "B-9"}, firmware, device};
};

TEST_F(TwoUsbDevices, TheOneInUseIsNamedAndTheOtherTold) {
  device.plug();
  second.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  const DeviceReport report = run.reports().back();
  EXPECT_EQ(report.state, DeviceState::connected);
  EXPECT_EQ(report.device, "1209:5a1d serial A-7 at 1-1");
  EXPECT_THAT(report.caution,
              ::testing::AllOf(::testing::HasSubstr("2 devices"), ::testing::HasSubstr("B-9"),
                               ::testing::HasSubstr("source.serial")));
}

TEST_F(TwoUsbDevices, OneThatComesLaterIsToldToo) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  EXPECT_EQ(run.reports().back().caution, "");
  second.plug();
  EXPECT_TRUE(comes_true([&] { return !run.reports().back().caution.empty(); }));
  second.unplug();
  EXPECT_TRUE(comes_true([&] { return run.reports().back().caution.empty(); }));
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 0U);
}

TEST_F(TwoUsbDevices, AfterAnUnplugTheOtherIsNotTaken) {
  device.plug();
  second.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.unplug();
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "it was unplugged"); }));
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "B-9 at 1-2"); }));
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "splid ctl stop"); }));
  const std::size_t photons = run.photons();
  const std::size_t before = run.publishes();  // once a look, while there is no device
  EXPECT_TRUE(comes_true([&] { return run.publishes() > before + 5; }));
  EXPECT_EQ(run.photons(), photons);
  device.plug();
  EXPECT_TRUE(goes_on(run));
  EXPECT_EQ(run.reports().back().device, "1209:5a1d serial A-7 at 1-1");
}

// Two that cannot be told apart but by where they are.
TEST(UsbDevicesWithoutSerial, ThePortIsKept) {
  test::Tags16Sender sender{test::steady_records};
  test::StreamFirmware firmware{[&](std::span<std::byte> room) { return sender(room); }};
  test::UsbDouble first{{{0x1209, 0x5a1d}, ""}, firmware};
  test::UsbDouble second{{{0x1209, 0x5a1d}, ""}, firmware, first};
  Tags16Options options;
  options.usb_id = "1209:5a1d";
  first.plug();
  second.plug();
  test::SourceRun run(options);
  ASSERT_TRUE(comes_true([&] { return run.photons() > 100; }));
  first.unplug();
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "1209:5a1d at 1-2"); }));
  first.plug();
  const std::size_t photons = run.photons();
  EXPECT_TRUE(comes_true([&] { return run.photons() > photons; }));
  EXPECT_EQ(run.reports().back().device, "1209:5a1d at 1-1");
}

class TwoOfOneSerial : public UsbSourceOnDouble {
 protected:
  static Tags16Options by_serial() {
    Tags16Options chosen = options();
    chosen.usb.serial = "A-7";
    return chosen;
  }
  void expect_the_port_is_kept(test::SourceRun& run) {
    EXPECT_THAT(run.reports().back().caution, ::testing::HasSubstr("of the same serial number"));
    device.unplug();
    EXPECT_TRUE(comes_true([&] {
      return run.said(DeviceState::no_device, "does not read 1209:5a1d serial A-7 at 1-2");
    }));
    device.plug();
    EXPECT_TRUE(goes_on(run));
    EXPECT_EQ(run.reports().back().device, "1209:5a1d serial A-7 at 1-1");
  }

  test::UsbDouble twin{{{0x1209, 0x5a1d}, "A-7"}, firmware, device};
};

TEST_F(TwoOfOneSerial, AreToldByTheirPorts) {
  device.plug();
  twin.plug();
  test::SourceRun run(by_serial());
  ASSERT_TRUE(goes_on(run));
  expect_the_port_is_kept(run);
}

TEST_F(TwoOfOneSerial, AreToldByTheirPortsWhereOneComesLater) {
  device.plug();
  test::SourceRun run(by_serial());
  ASSERT_TRUE(goes_on(run));
  twin.plug();
  ASSERT_TRUE(comes_true([&] { return !run.reports().back().caution.empty(); }));
  expect_the_port_is_kept(run);
}

// The same device, or another of its number: the report says that it is elsewhere.
TEST_F(TwoOfOneSerial, OneAtAnotherPortIsSaid) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.unplug();
  ASSERT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "it was unplugged"); }));
  sender.restart();
  twin.plug();
  EXPECT_TRUE(goes_on(run));
  EXPECT_TRUE(comes_true(
      [&] { return run.said(DeviceState::connected, "serial A-7 at 1-2: it was at 1-1 before"); }));
}

TEST(UsbDevicesOfStrangers, ASerialNumberIsShownWithoutControlCharacters) {
  test::Tags16Sender sender{test::steady_records};
  test::StreamFirmware firmware{[&](std::span<std::byte> room) { return sender(room); }};
  test::UsbDouble device{{{0x1209, 0x5a1d}, "A\x1b[31m7"}, firmware};
  Tags16Options options;
  options.usb_id = "1209:5a1d";
  device.plug();
  test::SourceRun run(options);
  ASSERT_TRUE(comes_true([&] { return run.photons() > 0; }));
  EXPECT_EQ(run.reports().back().device, "1209:5a1d serial A?[31m7 at 1-1");
}

TEST_F(UsbSourceOnDouble, AnEndpointThatIsHaltedAtTheStartIsCleared) {
  firmware.fail(-EPIPE);
  device.plug();
  test::SourceRun run(options());
  EXPECT_TRUE(goes_on(run));
  EXPECT_EQ(firmware.halts_cleared(), 1);
  EXPECT_TRUE(run.said(DeviceState::connected, "its endpoint 0x81 was halted and was cleared"));
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 0U);
}

TEST_F(UsbSourceOnDouble, AnEndpointThatStaysHaltedIsSaid) {
  firmware.fail(-EPIPE, 1'000'000);
  device.plug();
  test::SourceRun run(options());
  EXPECT_TRUE(comes_true(
      [&] { return run.said(DeviceState::failing, "halted again after it was cleared"); }));
}

TEST_F(UsbSourceOnDouble, ShortAndEmptyTransfersAreNormal) {
  device.plug();
  firmware.set_most_bytes(100);  // in the midst of records
  test::SourceRun run(options());
  EXPECT_TRUE(goes_on(run));
  firmware.fail(0, 5);
  EXPECT_TRUE(goes_on(run));
  run.stop();
  EXPECT_TRUE(every_gap_is_said(run.tags()));
  EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
}

struct Failure {
  const char* name;
  int status;
};

class UsbTransferFails : public UsbSourceOnDouble, public ::testing::WithParamInterface<Failure> {};

TEST_P(UsbTransferFails, IsALossAndSaidAndTheStreamGoesOn) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  sender.skip(3);
  firmware.fail(GetParam().status);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::loss_end) > 0; }));
  EXPECT_TRUE(goes_on(run));
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "tags were lost"); }));
  run.stop();
  EXPECT_TRUE(every_gap_is_said(run.tags()));
  EXPECT_GE(run.counter("splid_usb_transfers_total", {{"status", GetParam().name}}), 1U);
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 0U);
}

INSTANTIATE_TEST_SUITE_P(Kinds, UsbTransferFails,
                         ::testing::Values(Failure{"overflow", -EOVERFLOW},
                                           Failure{"error", -EPROTO}, Failure{"error", -ETIME},
                                           Failure{"error", -EILSEQ}, Failure{"stall", -EPIPE}));

TEST_F(UsbSourceOnDouble, AStallIsCleared) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.fail(-EPIPE);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "stalled and was"); }));
  EXPECT_TRUE(goes_on(run));
  EXPECT_EQ(firmware.halts_cleared(), 1);
  EXPECT_TRUE(comes_true([&] { return device.transfers_in_flight() == 8; }));
  for (const DeviceReport& report : run.reports()) {
    EXPECT_EQ(report.reason.find("tags were lost in"), std::string::npos) << report.reason;
  }
}

TEST_F(UsbSourceOnDouble, OneThatKeepsFailingIsOpenedAnew) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  const auto blocks = [&] { return run.counter("splid_tags16_blocks_total"); };
  const std::uint64_t blocks_before = blocks();
  EXPECT_GT(blocks_before, 0U);
  firmware.fail(-EPROTO, 100);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::failing, "in a row failed"); }));
  EXPECT_TRUE(goes_on(run));
  EXPECT_GT(blocks(), blocks_before);  // they go on, though the decoder is a new one
  EXPECT_EQ(run.reports().back().state, DeviceState::connected);
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 1U);
  EXPECT_GE(run.count(TagKind::clock_break), 1U);
}

TEST_F(UsbSourceOnDouble, AGapInTheBlocksIsALoss) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  sender.skip(5);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::loss_end) > 0; }));
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "5 blocks missing"); }));
  EXPECT_TRUE(goes_on(run));
  run.stop();
  EXPECT_TRUE(every_gap_is_said(run.tags()));
}

TEST_F(UsbSourceOnDouble, GarbageIsALossAndTheStreamIsFoundAgain) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  std::mt19937 random(5);
  std::vector<std::byte> garbage(4999);
  for (std::byte& byte : garbage) byte = static_cast<std::byte>(random());
  firmware.send(garbage);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::loss_end) > 0; }));
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "to no block"); }));
  EXPECT_TRUE(goes_on(run));
  run.stop();
  EXPECT_TRUE(every_gap_is_said(run.tags()));
}

TEST_F(UsbSourceOnDouble, SilenceIsSaidAndSoIsItsEnd) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  firmware.set_silent(true);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::failing, "sends nothing"); }));
  firmware.set_silent(false);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "it sent nothing for"); }));
  EXPECT_TRUE(goes_on(run));
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), 0U);
}

TEST_F(UsbSourceOnDouble, OneThatStaysSilentIsOpenedAnew) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  const test::Yardstick yardstick;
  const auto begin = std::chrono::steady_clock::now();
  firmware.set_silent(true);
  EXPECT_TRUE(comes_true([&] { return run.counter("splid_usb_reopens_total") > 0; }));
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  EXPECT_TRUE(yardstick.keeps(2000, took.count()));
  firmware.set_silent(false);
  EXPECT_TRUE(goes_on(run));
}

// Of a device that sends as fast as it is asked, 32 MiB wait; what comes then is dropped.
TEST_F(UsbSourceOnDouble, WhatTheQueueCannotHoldIsALoss) {
  sender.set_unpaced(true);
  device.plug();
  test::SourceRun run(options(), false);
  ASSERT_TRUE(goes_on(run));
  run.block(true);
  const auto dropped = [&] { return run.counter("splid_usb_dropped_bytes_total"); };
  EXPECT_TRUE(comes_true([&] { return dropped() > 0; }));
  run.block(false);
  EXPECT_TRUE(comes_true([&] { return run.count(TagKind::loss_end) > 0; }));
  EXPECT_TRUE(goes_on(run));
  EXPECT_TRUE(
      comes_true([&] { return run.said(DeviceState::connected, "decodes too slowly, and "); }));
  run.stop();
  EXPECT_FALSE(run.said(DeviceState::connected, "the last failure"));
  EXPECT_EQ(run.count(TagKind::loss_begin), run.count(TagKind::loss_end));
}

// 10 million tags of a scene, as fast as they are taken. bench/usb_rate measures how fast that is.
// The device waits while 16 MiB are on their way, half of what the queue holds: on a machine that
// is busy with other things what comes faster than it is read is dropped rightly.
TEST(UsbRate, TensOfMillionsOfTagsComeThroughWithoutALoss) {
  test::SceneLoop scene({test::paper_pattern(), test::bright_scene()}, 20, 24);
  constexpr std::uint64_t most_under_way = 16 << 20, tag_bytes = 16;
  std::atomic<std::uint64_t> taken = 0;  // tags
  std::uint64_t sent = 0;                // bytes
  test::StreamFirmware firmware([&](std::span<std::byte> room) -> std::size_t {
    if (sent > taken * tag_bytes + most_under_way) return 0;
    const std::size_t written = scene(room);
    sent += written;
    return written;
  });
  test::UsbDouble device({{0x1209, 0x5a1d}, "A-7"}, firmware);
  Tags16Options options;
  options.usb_id = "1209:5a1d";
  options.usb.transfers = 12;
  options.usb.transfer_kib = 1024;
  firmware.set_silent(true);  // what comes before the start is thrown away
  device.plug();
  test::SourceRun run(options, false);
  ASSERT_TRUE(comes_true([&] { return !run.reports().empty(); }));
  firmware.set_silent(false);
  EXPECT_TRUE(comes_true([&] {
    taken = run.photons();
    return taken == scene.tags();
  })) << taken;
  run.stop();
  EXPECT_GT(scene.tags(), 9'000'000U);
  EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
  EXPECT_EQ(run.counter("splid_usb_dropped_bytes_total"), 0U);
}

TEST_F(UsbSourceOnDouble, UnpluggedAndPluggedInAgain) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.unplug();
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "it was unplugged"); }));
  EXPECT_EQ(run.count(TagKind::clock_break), 1U);
  sender.restart();
  device.plug();
  EXPECT_TRUE(goes_on(run));
  run.stop();
  EXPECT_TRUE(every_gap_is_said(run.tags()));
  EXPECT_EQ(run.reports().back(),
            (DeviceReport{DeviceState::connected, "", "1209:5a1d serial A-7 at 1-1", ""}));
}

// 200 cycles take some seconds; scripts/reliability asks for 1,000.
TEST_F(UsbSourceOnDouble, ManyTimesLeaveNothingBehind) {
  const char* asked = std::getenv("SPLID_USB_CYCLES");
  const int cycles = asked == nullptr ? test::times(200) : std::stoi(asked);
  const auto began = std::chrono::steady_clock::now();
  test::SourceRun run(options(), false);
  ASSERT_TRUE(comes_true([&] { return run.said(DeviceState::no_device, "plugged in"); }));
  const std::size_t files = open_files();
  for (int cycle = 0; cycle < cycles; ++cycle) {
    sender.restart();
    device.plug();
    const std::size_t before = run.photons();
    ASSERT_TRUE(comes_true([&] { return run.photons() > before; })) << cycle;
    device.unplug();
    const auto breaks = static_cast<std::size_t>(cycle) + 1;
    ASSERT_TRUE(comes_true([&] { return run.count(TagKind::clock_break) == breaks; })) << cycle;
  }
  EXPECT_TRUE(comes_true([&] { return open_files() <= files; })) << open_files() << " " << files;
  EXPECT_EQ(run.counter("splid_usb_reopens_total"), static_cast<std::uint64_t>(cycles) - 1);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
  std::printf("%d cycles of plug, photons, unplug: %.1f ms each\n", cycles, took.count() / cycles);
}

TEST_F(UsbSourceOnDouble, TheKernelLosesItsRoomInMidStream) {
  device.plug();
  test::SourceRun run(options());
  ASSERT_TRUE(goes_on(run));
  device.set_most_transfers(5);
  EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, "no more room"); }));
  EXPECT_TRUE(goes_on(run));
  EXPECT_TRUE(comes_true([&] { return device.transfers_in_flight() == 4; }));
}

TEST_F(UsbSourceOnDouble, TheKernelHasRoomForFewerTransfers) {
  device.set_most_transfers(3);
  firmware.set_silent(true);  // a finished transfer would make room for another
  device.plug();
  test::SourceRun run(options());
  EXPECT_TRUE(
      comes_true([&] { return run.said(DeviceState::connected, "room for 2 of 8 transfers"); }));
  firmware.set_silent(false);
  EXPECT_TRUE(goes_on(run));
}

}  // namespace
}  // namespace splid::usb
