#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "tests/support/program.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/tdc2_firmware.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/ttm_sender.hpp"
#include "tests/support/usb_double.hpp"

// `splid devices` as a program, with emulated USB devices.

namespace splid {
namespace {

using test::ProgramResult;
using test::Tdc2Firmware;
using test::UsbDouble;
using ::testing::AllOf;
using ::testing::HasSubstr;

const test::UsbDoubleOptions tdc2 = {{0x3137, 0x200a}, "TDC2-0042", {0x01, 0x81, 0x82}};

class DevicesProgram : public ::testing::Test {
 protected:
  // The libusb of the program sees the emulated bus. Its configurations are none of this machine's.
  ProgramResult devices(std::vector<std::string> more) {
    setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
    setenv("ASAN_OPTIONS", "verify_asan_link_order=0:detect_leaks=0", 1);
    more.insert(more.begin(), "devices");
    more.insert(more.end(), {"--config", folder.path("none.json")});
    ProgramResult result = test::run_program(more);
    unsetenv("LD_PRELOAD");
    unsetenv("ASAN_OPTIONS");
    return result;
  }
  // A device of that id at the next port.
  void plug(const test::UsbDoubleOptions& options) {
    const int port = static_cast<int>(doubles.size()) + 1;
    doubles.push_back(port == 1
                          ? std::make_unique<UsbDouble>(options, firmware)
                          : std::make_unique<UsbDouble>(options, firmware, *doubles[0], port));
    doubles.back()->plug();
  }
  // So that the bus is there, without a device that splid knows.
  void plug_unknown() { plug({{0x1209, 0x0001}, "", {0x81}}); }

  test::TempFolder folder;
  Tdc2Firmware firmware;
  std::vector<std::unique_ptr<UsbDouble>> doubles;
};

TEST_F(DevicesProgram, NoneAreToldOnStandardError) {
  plug_unknown();
  const ProgramResult result = devices({});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(
      result.err,
      "no known USB instrument is plugged in, no bridge runs, and no configuration names one; "
      "splid devices --all lists all USB devices\n");
}

TEST_F(DevicesProgram, OneIsListedWithItsDriver) {
  plug(tdc2);
  const ProgramResult result = devices({});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out,
            "place    read by                 what\n"
            "001:002  driver tdc2             3137:200a, serial TDC2-0042, 480 Mbit/s\n");
}

TEST_F(DevicesProgram, FiveAreListedWithWhatReadsEach) {
  plug(tdc2);
  plug({{0x0e0d, 0x0013}, "1045678", {0x81}});
  plug_unknown();
  plug({{0x151f, 0x0123}, "", {0x81}});
  plug({{0x04b4, 0x123a}, "", {0x81}});
  plug({{0x0e0d, 0x0004}, "1000004", {0x81}});
  EXPECT_EQ(devices({}).out,
            "place    read by                 what\n"
            "001:002  driver tdc2             3137:200a, serial TDC2-0042, 480 Mbit/s\n"
            "001:022  splid bridge picoquant  0e0d:0013 MultiHarp, serial 1045678, 480 Mbit/s\n"
            "001:062  swabian_bridge.py       151f:0123 Opal Kelly module (Swabian Time Tagger), "
            "480 Mbit/s\n"
            "001:082  driver tdc2             04b4:123a, 480 Mbit/s\n"
            "001:102  splid bridge picoquant  0e0d:0004 HydraHarp 400, serial 1000004, "
            "480 Mbit/s\n");
  EXPECT_THAT(devices({"--all"}).out, HasSubstr("\n001:042  -                       1209:0001"));
}

TEST_F(DevicesProgram, AnInstrumentIsTriedAndItsConfigurationPrinted) {
  plug(tdc2);
  const ProgramResult result = devices({"--try", "001:002", "--seconds", "0.5"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, ::testing::ContainsRegex("input 1 +[0-9]+ /s   one each 10000.000 ns"));
  EXPECT_THAT(result.out, ::testing::ContainsRegex("input 4 +[0-9]+ /s   one each 100000.000 ns"));
  EXPECT_THAT(result.out, ::testing::ContainsRegex("losses +0\n")) << result.err;
  // The configuration loads, once it names a pattern.
  std::string config = result.out.substr(result.out.find("\n{") + 1);
  EXPECT_THAT(config, HasSubstr("\"serial\": \"TDC2-0042\""));
  EXPECT_THAT(config, HasSubstr("\"sync\": \"4\""));
  const std::string pattern = "PATTERN.json";
  config.replace(config.find(pattern), pattern.size(),
                 SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json");
  const ProgramResult check = test::run_program({"check", folder.write("config.json", config)});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  EXPECT_THAT(check.out, HasSubstr("source   tdc2"));
}

// Its syncs come beside photons alone.
TEST_F(DevicesProgram, ABrightEyesIsTriedWithThePeriodOfItsSyncs) {
  std::mt19937 random(5);
  test::TtmSender sender([&](std::int64_t begin_ps, std::int64_t end_ps) {
    constexpr std::int64_t period_ps = 1'000'000;
    std::vector<test::TtmEvent> events;
    for (std::int64_t at_ps = begin_ps; at_ps < end_ps; at_ps += period_ps) {
      events.push_back({at_ps, test::TtmEvent::laser});
      if (random() % 10 == 0) events.push_back({at_ps + 400'000, at_ps % 2'000'000 == 0 ? 3 : 12});
    }
    return events;
  });
  test::StreamFirmware sends([&](std::span<std::byte> room) { return sender(room); });
  UsbDouble device({{0x04b4, 0x00f1}, "TTM-5"}, sends);
  device.plug();
  const ProgramResult result = devices({"--try", "001:002", "--seconds", "0.5"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              ::testing::MatchesRegex("input 12 +[0-9]+ /s\ninput 3 +[0-9]+ /s\n"
                                      "sync +[0-9]+ /s   one each (1000\\.00|999\\.99)[0-9] ns\n"
                                      "losses +0\n\n\\{\n(.|\n)*"))
      << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("\"driver\": \"brighteyes-ttm\""), HasSubstr("\"serial\": \"TTM-5\""),
                    HasSubstr("\"sync\": \"sync\"")));
}

TEST_F(DevicesProgram, ADarkInstrumentIsADeviceError) {
  plug(tdc2);
  firmware.set_dark(true);
  const ProgramResult result = devices({"--try", "001:002", "--seconds", "0.2"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("001:002: it sends nothing"));
}

TEST_F(DevicesProgram, APlaceWithoutADriverIsRefused) {
  plug(tdc2);
  plug({{0x0e0d, 0x0013}, "1045678", {0x81}});
  const ProgramResult bridged = devices({"--try", "001:022"});
  EXPECT_EQ(bridged.exit_code, 2);
  EXPECT_THAT(bridged.err, HasSubstr("001:022: a MultiHarp is read by splid bridge picoquant: "
                                     "start that, and try its socket"));
  const ProgramResult none = devices({"--try", "001:099"});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("there is no device at 001:099; splid devices lists"));
}

}  // namespace
}  // namespace splid
