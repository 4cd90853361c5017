#include "tests/support/usb_daemon.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cerrno>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"
#include "protocol/pattern_json.hpp"
#include "tests/support/fault_record.hpp"
#include "tests/support/program.hpp"
#include "tests/support/scene_records.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/tags16_sender.hpp"
#include "tests/support/usb_double.hpp"

// The built program, unmodified and in a process of its own, from an emulated USB device in to
// ZeroMQ out. How soon it says what happened is asserted beside the machine's slowness, and how
// soon good frames come again on the device's clock.

namespace splid {
namespace {

using ::testing::HasSubstr;

class UsbDaemon : public ::testing::Test, protected test::UsbDaemonRun {
 protected:
  UsbDaemon() {
    start(R"("source":{"driver":"tags16-usb","usb_id":"1209:5a1d","transfers":8,)"
          R"("transfer_kib":64},"channels":{"photon":[1],"sync":"8"})");
  }
  ~UsbDaemon() override { stop(); }

  void plug_in_and_measure() {
    device.plug();
    ASSERT_TRUE(await_frame());
    forget();
  }

  test::Tags16Sender sender{test::SceneRecords(
      pattern_from_json(test::file_text(pattern_file), pattern_file), scene_options())};
  test::StreamFirmware firmware{[this](std::span<std::byte> room) { return sender(room); }};
  test::UsbDouble device{{{0x1209, 0x5a1d}, "A-7"}, firmware};
};

TEST_F(UsbDaemon, WaitsForTheDeviceAndMeasuresOnceItIsThere) {
  EXPECT_TRUE(await_status("no_device", "no USB device 1209:5a1d is plugged in"));
  plug_in_and_measure();
  EXPECT_TRUE(await_status("connected", "\"state\":\"streaming\""));
}

// Three times: the status says so within 100 ms, and within 2 s frames come of the new clock's
// first seconds.
TEST_F(UsbDaemon, UnpluggedAndPluggedInAgain) {
  std::vector<double> gone_ms;
  std::vector<double> back_ms;
  plug_in_and_measure();
  for (int i = 0; i < 3; ++i) {
    device.unplug();
    EXPECT_TRUE(await_status("no_device", "it was unplugged"));
    gone_ms.push_back(said_ms);
    sender.restart();
    device.plug();
    const auto frame = await_frame();
    ASSERT_TRUE(frame);
    EXPECT_LT(frame->start_ps, 40 * frame_ps);
    back_ms.push_back(waited.count());
    forget();
  }
  EXPECT_TRUE(yardstick.keeps(100, test::median(gone_ms)));
  EXPECT_TRUE(yardstick.keeps(2000, test::median(back_ms)));
  test::record({"USB device is unplugged, and plugged in again", "no_device: it was unplugged",
                test::median(gone_ms), "the time between", test::median(back_ms)});
}

TEST_F(UsbDaemon, ASilentDeviceIsSaidAndSoIsItsReturn) {
  plug_in_and_measure();
  firmware.set_silent(true);
  EXPECT_TRUE(await_status("failing", "sends nothing"));
  const double silent_ms = said_ms;
  EXPECT_TRUE(yardstick.keeps(200, silent_ms));  // four frames
  firmware.set_silent(false);
  EXPECT_TRUE(await_status("connected", "it sent nothing for"));
  EXPECT_TRUE(await_frame());
  test::record({"USB device sends nothing", "failing: it sends nothing, not even an empty block",
                silent_ms, "", waited.count()});
  // The frame that the silence was in has no syncs; not for want of a cable.
  EXPECT_THAT(statuses, ::testing::Not(HasSubstr("channels.sync")));
}

TEST_F(UsbDaemon, OfTwoTheOneInUseIsNamedAndTheOtherNotTaken) {
  test::UsbDouble second{{{0x1209, 0x5a1d}, "B-9"}, firmware, device};
  plug_in_and_measure();
  EXPECT_TRUE(await_status("connected", R"("device_name":"1209:5a1d serial A-7 at 1-1")"));
  second.plug();
  EXPECT_TRUE(await_status("connected", "2 devices that source could mean are plugged in"));
  device.unplug();
  EXPECT_TRUE(await_status("no_device", "does not read 1209:5a1d serial B-9 at 1-2"));
  sender.restart();
  device.plug();
  EXPECT_TRUE(await_frame());
}

TEST_F(UsbDaemon, AStallIsClearedAndSaid) {
  plug_in_and_measure();
  sender.skip(3);
  firmware.fail(-EPIPE);
  EXPECT_TRUE(await_status("connected", "stalled and was cleared"));
  EXPECT_TRUE(await_frame());
  test::record({"USB endpoint stalls", "connected: its endpoint stalled and was cleared", said_ms,
                "3 ms or more", waited.count()});
}

TEST_F(UsbDaemon, AFailedTransferIsALossInItsFrame) {
  plug_in_and_measure();
  sender.skip(3);
  firmware.fail(-EPROTO);
  // 3 of 50 ms or of two frames; the frame still measures.
  EXPECT_TRUE(await(topic_frame, [](const std::string& json) {
    const FrameMessage frame = frame_from_json(json);
    return frame.seen_fraction && *frame.seen_fraction < 0.999 && frame.valid();
  }));
}

// The list of faults: each is injected into a running stream, the status says what happened, and of
// the frames after it two at most do not measure.
struct DeviceFault {
  const char* name;
  std::function<void(test::StreamFirmware&, test::UsbDouble&, test::Tags16Sender&)> inject;
  const char* reason;  // empty: nothing is wrong, and nothing is reported
};

void PrintTo(const DeviceFault& fault, std::ostream* out) { *out << fault.name; }

class UsbDaemonFault : public UsbDaemon, public ::testing::WithParamInterface<DeviceFault> {};

TEST_P(UsbDaemonFault, IsSaidAndFramesComeAgain) {
  plug_in_and_measure();
  const std::int64_t begin_ps = sender.now_ps();
  GetParam().inject(firmware, device, sender);
  if (*GetParam().reason != '\0') {
    EXPECT_TRUE(await_status("connected", GetParam().reason));
    EXPECT_TRUE(yardstick.keeps(100, said_ms));
  }
  int bad = 0;
  double unseen_ms = 0;
  std::int64_t good_start_ps = 0;
  EXPECT_TRUE(await(topic_frame, [&](const std::string& json) {
    const FrameMessage frame = frame_from_json(json);
    const bool good = frame.status == FrameStatus::ok && frame.seen_fraction.value_or(0) == 1;
    bad += good || frame.valid() ? 0 : 1;
    unseen_ms += (1 - frame.seen_fraction.value_or(1)) * frame.duration_ms;
    good_start_ps = frame.start_ps;
    return good;
  }));
  EXPECT_LE(bad, 2);
  EXPECT_LE(good_start_ps, begin_ps + 2 * frame_ps);
  test::record({std::string("USB transfers: ") + GetParam().name,
                *GetParam().reason == '\0' ? "nothing: nothing is wrong"
                                           : std::string("connected: ") + GetParam().reason,
                said_ms, test::in_ms(unseen_ms) + " unseen", waited.count()});
}

DeviceFault failed(const char* name, int status) {
  return {name,
          [status](test::StreamFirmware& firmware, test::UsbDouble&, test::Tags16Sender& sender) {
            sender.skip(3);
            firmware.fail(status);
          },
          "tags were lost in"};
}

INSTANTIATE_TEST_SUITE_P(
    List, UsbDaemonFault,
    ::testing::Values(failed("overflow", -EOVERFLOW), failed("protocol", -EPROTO),
                      failed("timeout", -ETIME), failed("illegalSequence", -EILSEQ),
                      DeviceFault{"short",
                                  [](test::StreamFirmware& firmware, test::UsbDouble&,
                                     test::Tags16Sender&) { firmware.set_most_bytes(4096 + 100); },
                                  ""},
                      DeviceFault{"empty",
                                  [](test::StreamFirmware& firmware, test::UsbDouble&,
                                     test::Tags16Sender&) { firmware.fail(0, 5); },
                                  ""},
                      DeviceFault{"noMemory",
                                  [](test::StreamFirmware&, test::UsbDouble& device,
                                     test::Tags16Sender&) { device.set_most_transfers(5); },
                                  "no more room"}),
    [](const auto& fault) { return fault.param.name; });

TEST_F(UsbDaemon, AGapInTheBlocksIsALossInItsFrame) {
  plug_in_and_measure();
  const std::int64_t begin_ps = sender.now_ps();
  sender.skip(3);
  EXPECT_TRUE(await(topic_frame, [](const std::string& json) {
    const FrameMessage frame = frame_from_json(json);
    return frame.valid() && frame.seen_fraction.value_or(1) < 1;
  }));
  const double shown_ms = waited.count();
  const auto frame = await_frame();
  ASSERT_TRUE(frame);
  EXPECT_LE(frame->start_ps, begin_ps + 2 * frame_ps);
  test::record({"USB: 3 ms of blocks are missing", "a frame: ok", shown_ms, "3 ms unseen",
                shown_ms + waited.count()});
}

// A device that lost what it had, and knows no more than that: its blocks' times meet.
TEST_F(UsbDaemon, AGapInTheNumbersIsALossInItsFrame) {
  plug_in_and_measure();
  const std::int64_t begin_ps = sender.now_ps();
  sender.skip_numbers(2);
  std::optional<FrameMessage> frame;
  EXPECT_TRUE(await(topic_frame, [&](const std::string& json) {
    frame = frame_from_json(json);
    return frame->uncounted_losses > 0;
  }));
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->uncounted_losses, 1U);
  EXPECT_TRUE(frame->valid());
  EXPECT_LE(frame->start_ps, begin_ps);
  const double shown_ms = waited.count();
  const auto good = await_frame();
  ASSERT_TRUE(good);
  EXPECT_LE(good->start_ps, begin_ps + 2 * frame_ps);
  test::record({"USB: two blocks' numbers are missing, and no time", "a frame: ok", shown_ms,
                "1 loss, of nobody knows how many tags", shown_ms + waited.count()});
}

TEST_F(UsbDaemon, GarbageInPlaceOfBlocksIsALossAndFramesGoOn) {
  plug_in_and_measure();
  std::mt19937 random(5);
  std::vector<std::byte> garbage(5003);
  for (std::byte& byte : garbage) byte = static_cast<std::byte>(random());
  sender.skip(3);
  firmware.send(garbage);
  EXPECT_TRUE(await(topic_frame, [](const std::string& json) {
    return frame_from_json(json).seen_fraction.value_or(1) < 1;
  }));
  firmware.send(garbage);
  EXPECT_TRUE(await_status("connected", "bytes that belong to no block"));
  EXPECT_TRUE(await_frame());
  test::record({"USB: 5,003 bytes of garbage in place of 3 ms of blocks",
                "connected: bytes that belong to no block", said_ms, "3 ms or more",
                waited.count()});
}

TEST_F(UsbDaemon, DevicesListsIt) {
  // A daemon that has only begun may not be ended yet.
  ASSERT_TRUE(await(topic_status, [](const std::string&) { return true; }));
  device.plug();
  setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
  setenv("ASAN_OPTIONS", "verify_asan_link_order=0:detect_leaks=0", 1);
  const test::ProgramResult all = test::run_program({"devices", "--all"});
  const test::ProgramResult known =
      test::run_program({"devices", "--config", folder.path("none.json")});
  unsetenv("LD_PRELOAD");
  unsetenv("ASAN_OPTIONS");
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_THAT(all.out,
              HasSubstr("001:002  -                       1209:5a1d, serial A-7, 480 Mbit/s"));
  EXPECT_EQ(known.exit_code, 0) << known.err;
  EXPECT_EQ(known.out, "");
  EXPECT_THAT(known.err, HasSubstr("no known USB instrument is plugged in"));
}

}  // namespace
}  // namespace splid
