#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"
#include "drivers/usb/ttm.hpp"
#include "protocol/frame_json.hpp"
#include "tests/support/laser_recording.hpp"
#include "tests/support/program.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/ttm_encoder.hpp"
#include "tests/support/usb_double.hpp"
#include "tests/support/usb_run.hpp"

// A recording with 1 ps steps through an emulated BrightEyes-TTM, whose taps have 32 and 64 ps, and
// back: the same tags, and the same frames to within 48 ps. Each calibrates and measures 0.3 s of
// photons, which takes more than 1 s.

namespace splid {
namespace {

using test::comes_true;
using test::TtmEvent;

constexpr double tap_m = 48e-12 * 299'792'458 / 2;

class TtmRecording : public ::testing::Test {
 protected:
  // An input takes one photon in a period of the clock.
  static void leave_out_close_photons(std::vector<Tag>& tags) {
    std::array<std::int64_t, 3> latest_ps{};
    std::erase_if(tags, [&](const Tag& tag) {
      if (tag.kind != TagKind::photon) return false;
      std::int64_t& before_ps = latest_ps.at(static_cast<std::size_t>(tag.value));
      if (tag.time_ps < before_ps + 5000) return true;
      before_ps = tag.time_ps;
      return false;
    });
  }

  // The tags that the driver makes of what the instrument would send of these.
  static std::vector<Tag> through_the_instrument(const std::vector<Tag>& tags) {
    std::vector<TtmEvent> events;
    for (const Tag& tag : tags) {
      events.push_back({tag.time_ps, tag.kind == TagKind::sync ? TtmEvent::laser : tag.value});
    }
    test::TtmEncoder encoder;
    encoder.filters_laser = false;
    std::vector<std::byte> bytes;
    encoder.append(events, tags.back().time_ps + 1'000'000, bytes);
    test::StreamFirmware firmware([&, at = std::size_t{0}](std::span<std::byte> room) mutable {
      const std::size_t count = std::min(room.size(), bytes.size() - at);
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), count, room.begin());
      at += count;
      return count;
    });
    test::UsbDouble device({{0x04b4, 0x00f1}, "TTM-5"}, firmware);
    firmware.set_silent(true);  // until what waits in the device has been drained
    device.plug();
    test::SourceRun run((usb::TtmOptions()));
    EXPECT_TRUE(comes_true([&] { return run.said(DeviceState::connected, ""); }));
    firmware.set_silent(false);
    const auto photons = std::ranges::count(tags, TagKind::photon, &Tag::kind);
    EXPECT_TRUE(comes_true([&] { return run.photons() == static_cast<std::size_t>(photons); }));
    run.stop();
    EXPECT_EQ(run.count(TagKind::loss_begin), 0U);
    std::vector<Tag> came = run.tags();
    std::erase_if(came, [](const Tag& tag) { return !is_event(tag.kind); });
    return came;
  }

  static std::vector<std::int64_t> times(const std::vector<Tag>& tags, TagKind kind, int value) {
    std::vector<std::int64_t> times_ps;
    for (const Tag& tag : tags) {
      if (tag.kind == kind && tag.value == value) times_ps.push_back(tag.time_ps);
    }
    return times_ps;
  }

  // Half of a tap, and what the calibration of taps may be wrong by: 8 ps that a tap is not 48 ps
  // long, and four times what 4,096 hits leave.
  static void expect_the_same_times(const std::vector<Tag>& sent, const std::vector<Tag>& came,
                                    TagKind kind, int value) {
    const auto before = times(sent, kind, value);
    const auto after = times(came, kind, value);
    ASSERT_EQ(after.size(), before.size());
    double mean_ps = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const auto error_ps = static_cast<double>(after[i] - before[i]);
      ASSERT_LE(std::abs(error_ps), 32 + 8 + 4 * 33);
      mean_ps += error_ps / static_cast<double>(before.size());
    }
    EXPECT_NEAR(mean_ps, 0, 15);
  }

  void write(const std::string& name, const std::vector<Tag>& tags) const {
    const DeviceClock clock{SourceInfo{"made", false, 1.6e9}, host_clock()};
    PtuFacts facts;
    facts.instrument = "made";
    recording::PtuWriter writer(folder.path(name), facts, clock, true);
    writer.write(tags);
    writer.close();
  }

  [[nodiscard]] std::string config(const std::string& pattern, const std::string& more = "") const {
    return folder.write("config.json",
                        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"replay",)"
                        R"("recording":"sent.ptu"},"channels":{"photon":[1]},"pattern":{"file":")" +
                            pattern + R"("})" + more + "}");
  }

  [[nodiscard]] std::vector<FrameMessage> frames(const std::string& name) const {
    const test::ProgramResult result = test::run_program(
        {"replay", folder.path(name), "--config",
         config("found.json", R"(,"pulse":{"shape":"tabulated"})"), "--no-publish", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<FrameMessage> list;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) list.push_back(frame_from_json(line));
    return list;
  }

  void expect_the_same_frames(std::vector<Tag> sent) {
    // The instrument's clock begins before the first tag.
    const std::int64_t shift_ps = 1'000'000'000 - sent.front().time_ps;
    for (Tag& tag : sent) tag.time_ps += shift_ps;
    std::erase_if(sent, [](const Tag& tag) { return !is_event(tag.kind); });
    leave_out_close_photons(sent);
    std::vector<Tag> came = through_the_instrument(sent);
    expect_the_same_times(sent, came, TagKind::photon, 1);
    expect_the_same_times(sent, came, TagKind::photon, 2);
    expect_the_same_times(sent, came, TagKind::sync, 0);
    std::ranges::sort(came, {}, &Tag::time_ps);
    write("sent.ptu", sent);
    write("came.ptu", came);
    folder.write("nominal.json",
                 R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline",)"
                 R"("unambiguous_delay_ps":12512.6,"segments":[{"period_ps":12512.6,)"
                 R"("pulse_times_ps":[0],"amplitudes":[1],"repeats":0}]})");
    const test::ProgramResult calibrated =
        test::run_program({"calibrate", folder.path("sent.ptu"), "--config", config("nominal.json"),
                           "--output", folder.path("found.json")});
    ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
    const auto before = frames("sent.ptu");
    const auto after = frames("came.ptu");
    ASSERT_EQ(after.size(), before.size());
    ASSERT_GE(before.size(), 5U);
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_EQ(after[i].status, before[i].status);
      EXPECT_NEAR(*after[i].distance_m, *before[i].distance_m, tap_m);
      EXPECT_NEAR(*after[i].velocity_mps, *before[i].velocity_mps, 3 * *after[i].std_velocity_mps);
    }
  }

  test::TempFolder folder;
};

TEST_F(TtmRecording, ALasersFramesAreThoseOfItsReplay) {
  expect_the_same_frames(test::LaserRecording::tags());
}

TEST_F(TtmRecording, AQutagsFramesAreThoseOfItsReplay) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  expect_the_same_frames(test::ptu_tags(file));
}

}  // namespace
}  // namespace splid
