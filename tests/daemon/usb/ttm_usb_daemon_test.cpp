#include <gtest/gtest.h>

#include <cerrno>
#include <cstdint>
#include <functional>
#include <ostream>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "protocol/frame_json.hpp"
#include "protocol/pattern_json.hpp"
#include "tests/support/fault_record.hpp"
#include "tests/support/scene_records.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/ttm_sender.hpp"
#include "tests/support/usb_daemon.hpp"
#include "tests/support/usb_double.hpp"

// The built program on an emulated BrightEyes-TTM: a simulated scene on input 12, the pattern's
// syncs on the laser's input, which sends those beside photons alone, and lines of 20 ms.

namespace splid {
namespace {

using test::TtmEvent;

constexpr std::int64_t line_ps = 20'000'000'000;

class SceneEvents {
 public:
  explicit SceneEvents(test::SceneRecords scene) : scene_(std::move(scene)) {}

  std::vector<TtmEvent> operator()(std::int64_t begin_ps, std::int64_t end_ps) {
    std::vector<TtmEvent> events;
    if (begin_ps % line_ps == 0) events.push_back({begin_ps, TtmEvent::line});
    for (const test::Tags16Record& record : scene_(begin_ps, end_ps)) {
      events.push_back({record.time_ps, record.channel == 8 ? TtmEvent::laser : 12});
    }
    return events;
  }

 private:
  test::SceneRecords scene_;
};

class TtmUsbDaemon : public ::testing::Test, protected test::UsbDaemonRun {
 protected:
  void measure() {
    start(R"("source":{"driver":"brighteyes-ttm","serial":"TTM-5","transfers":8,)"
          R"("transfer_kib":64},"channels":{"photon":[12],"sync":"sync","encoder":""})");
    device.plug();
    ASSERT_TRUE(await_frame());
    forget();
  }
  ~TtmUsbDaemon() override { stop(); }

  test::TtmSender sender{SceneEvents(test::SceneRecords(
      pattern_from_json(test::file_text(pattern_file), pattern_file), scene_options()))};
  test::StreamFirmware firmware{[this](std::span<std::byte> room) { return sender(room); }};
  test::UsbDouble device{{{0x04b4, 0x00f1}, "TTM-5"}, firmware};
};

TEST_F(TtmUsbDaemon, AnotherSerialNumberIsNotTaken) {
  start(R"("source":{"driver":"brighteyes-ttm","serial":"TTM-6"},)"
        R"("channels":{"photon":[12],"sync":"sync"})");
  device.plug();
  EXPECT_TRUE(await_status("no_device", "no USB device 04b4:00f1 with serial TTM-6 is plugged in"));
  test::record({"BrightEyes-TTM of another serial number",
                "no_device: no USB device 04b4:00f1 with serial TTM-6 is plugged in", -1, "", -1});
}

TEST_F(TtmUsbDaemon, UnpluggedAndPluggedInAgain) {
  measure();
  device.unplug();
  EXPECT_TRUE(await_status("no_device", "it was unplugged"));
  const double gone_ms = said_ms;
  sender.restart();
  device.plug();
  EXPECT_TRUE(await_frame());
  test::record({"BrightEyes-TTM is unplugged, and plugged in again", "no_device: it was unplugged",
                gone_ms, "the time between", waited.count()});
}

struct TtmFault {
  using Act = std::function<void(test::TtmSender&, test::StreamFirmware&)>;

  const char* name;
  Act inject;
  Act mend;           // after the status tells of the fault
  const char* state;  // of the device
  const char* reason;
};

void PrintTo(const TtmFault& fault, std::ostream* out) { *out << fault.name; }

void nothing(test::TtmSender&, test::StreamFirmware&) {}

void send_garbage(test::TtmSender& sender, test::StreamFirmware& firmware) {
  std::mt19937 random(5);
  std::vector<std::byte> garbage(5003);
  for (std::byte& byte : garbage) byte = static_cast<std::byte>(random());
  sender.skip(3);
  firmware.send(garbage);
}

TtmFault::Act on_sender(void (test::TtmSender::*call)(bool), bool value) {
  return [=](test::TtmSender& sender, test::StreamFirmware&) { (sender.*call)(value); };
}

TtmFault::Act silence(bool silent) {
  return [=](test::TtmSender&, test::StreamFirmware& firmware) { firmware.set_silent(silent); };
}

class TtmUsbDaemonFault : public TtmUsbDaemon, public ::testing::WithParamInterface<TtmFault> {};

TEST_P(TtmUsbDaemonFault, IsSaidAndFramesComeAgain) {
  const TtmFault& fault = GetParam();
  measure();
  fault.inject(sender, firmware);
  EXPECT_TRUE(await_status(fault.state, fault.reason));
  fault.mend(sender, firmware);
  double unseen_ms = 0;
  EXPECT_TRUE(await(topic_frame, [&](const std::string& json) {
    const FrameMessage frame = frame_from_json(json);
    unseen_ms += (1 - frame.seen_fraction.value_or(1)) * frame.duration_ms;
    return frame.status == FrameStatus::ok && frame.seen_fraction.value_or(0) == 1;
  }));
  const double good_ms = waited.count();
  EXPECT_TRUE(await_frame());
  test::record({std::string("BrightEyes-TTM: ") + fault.name,
                std::string(fault.state) + ": " + fault.reason, said_ms,
                test::in_ms(unseen_ms) + " unseen", good_ms});
}

INSTANTIATE_TEST_SUITE_P(
    List, TtmUsbDaemonFault,
    ::testing::Values(
        TtmFault{"its memory is nearly full, so that it drops photons",
                 on_sender(&test::TtmSender::set_drops, true),
                 on_sender(&test::TtmSender::set_drops, false), "connected",
                 "its memory was nearly full and it dropped photons"},
        TtmFault{"3 ms of records are missing", [](auto& sender, auto&) { sender.skip(3); },
                 nothing, "connected", "records are missing by their clock"},
        TtmFault{"5,003 bytes of garbage in place of 3 ms of records", send_garbage, nothing,
                 "connected", "its records were none that can be"},
        TtmFault{"a transfer fails, and 3 ms of records are lost",
                 [](auto& sender, auto& firmware) {
                   sender.skip(3);
                   firmware.fail(-EPROTO);
                 },
                 nothing, "connected", "tags were lost in"},
        TtmFault{"it sends nothing", silence(true), silence(false), "failing", "it sends nothing"},
        TtmFault{"it sends padding alone", on_sender(&test::TtmSender::set_pads, true),
                 on_sender(&test::TtmSender::set_pads, false), "failing",
                 "what it sends is no records of protocol 2"}),
    [](const auto& fault) { return "Fault" + std::to_string(fault.index); });

TEST_F(TtmUsbDaemon, TransfersThatEndWithinRecordsAreNormal) {
  measure();
  firmware.set_most_bytes(4098);
  for (int i = 0; i < 4; ++i) {
    const auto frame = await_frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->seen_fraction, 1);
  }
  test::record({"BrightEyes-TTM: transfers end within records", "nothing: nothing is wrong", -1,
                "0 ms unseen", -1});
}

}  // namespace
}  // namespace splid
