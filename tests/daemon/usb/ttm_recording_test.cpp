#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"
#include "drivers/usb/ttm.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/bridged_frames.hpp"
#include "tests/support/bridged_run.hpp"
#include "tests/support/laser_recording.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/ttm_encoder.hpp"
#include "tests/support/usb_double.hpp"
#include "tests/support/usb_run.hpp"

// A recording with 1 ps steps through an emulated BrightEyes-TTM, whose taps have 32 and 64 ps, and
// back: the same tags to within what its taps tell; and, once its times are those of taps that were
// calibrated before, the frames of its replay, to the bit.

namespace splid {
namespace {

using test::comes_true;
using test::TtmEncoder;
using test::TtmEvent;

constexpr std::int64_t thirds_a_period = 12'500;

class TtmRecording : public ::testing::Test {
 protected:
  // As the instrument sees it: its clock begins before the first tag, and an input takes one photon
  // in a period of the clock.
  static std::vector<Tag> seen(std::vector<Tag> tags) {
    const std::int64_t shift_ps = 1'000'000'000 - tags.front().time_ps;
    std::array<std::int64_t, 3> latest_ps{};
    std::erase_if(tags, [&](Tag& tag) {
      if (!is_event(tag.kind)) return true;
      tag.time_ps += shift_ps;
      if (tag.kind != TagKind::photon) return false;
      std::int64_t& before_ps = latest_ps.at(static_cast<std::size_t>(tag.value));
      if (tag.time_ps < before_ps + 5000) return true;
      before_ps = tag.time_ps;
      return false;
    });
    return tags;
  }

  // In the order in which the driver gives those of one time.
  static void sort(std::vector<Tag>& tags) {
    std::ranges::sort(tags, {},
                      [](const Tag& tag) { return std::tuple(tag.time_ps, tag.kind, tag.value); });
  }

  static std::vector<std::byte> sent(const std::vector<Tag>& tags,
                                     const std::vector<TtmEvent>& before = {}) {
    TtmEncoder encoder;
    encoder.filters_laser = false;
    std::vector<std::byte> bytes;
    if (!before.empty()) {
      encoder.skip_to(before.front().time_ps);
      encoder.append(before, before.back().time_ps + 1'000'000, bytes);
      encoder.skip_to(tags.front().time_ps - 1'000'000);
    }
    std::vector<TtmEvent> events;
    for (const Tag& tag : tags) {
      events.push_back({tag.time_ps, tag.kind == TagKind::sync ? TtmEvent::laser : tag.value});
    }
    encoder.append(events, tags.back().time_ps + 1'000'000, bytes);
    return bytes;
  }

  static test::StreamFirmware::Supply supply(std::vector<std::byte> bytes) {
    return [bytes = std::move(bytes), at = std::size_t{0}](std::span<std::byte> room) mutable {
      const std::size_t count = std::min(room.size(), bytes.size() - at);
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), count, room.begin());
      at += count;
      return count;
    };
  }

  // The tags that the driver makes of what the instrument would send of these.
  static std::vector<Tag> through_the_instrument(const std::vector<Tag>& tags) {
    test::StreamFirmware firmware(supply(sent(tags)));
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
  static void expect_the_same_times(const std::vector<Tag>& tags) {
    const std::vector<Tag> before = seen(tags);
    const std::vector<Tag> after = through_the_instrument(before);
    for (const auto& [kind, value] :
         {std::pair(TagKind::photon, 1), {TagKind::photon, 2}, {TagKind::sync, 0}}) {
      const auto before_ps = times(before, kind, value);
      const auto after_ps = times(after, kind, value);
      ASSERT_EQ(after_ps.size(), before_ps.size());
      double mean_ps = 0;
      for (std::size_t i = 0; i < before_ps.size(); ++i) {
        const auto error_ps = static_cast<double>(after_ps[i] - before_ps[i]);
        ASSERT_LE(std::abs(error_ps), 32 + 8 + 4 * 33);
        mean_ps += error_ps / static_cast<double>(before_ps.size());
      }
      EXPECT_NEAR(mean_ps, 0, 15);
    }
  }

  // Hits of all times within a period, as many of each, from which the driver makes a table that it
  // keeps for as many more. Before them is a record that nobody reads: that a stream begins with.
  static std::vector<TtmEvent> calibrating_light() {
    constexpr std::int64_t hits = 131'072;
    std::int64_t period = 10'000'000;
    std::vector<TtmEvent> events = {{period * thirds_a_period / 3, TtmEvent::pixel}};
    for (std::int64_t i = 0; i < hits; ++i) {
      const std::int64_t before_edge = i * thirds_a_period / hits;
      do {
        ++period;
      } while ((period * thirds_a_period - before_edge) % 3 != 0);
      const std::int64_t time_ps = (period * thirds_a_period - before_edge) / 3;
      for (const int what : {1, 2, TtmEvent::laser}) events.push_back({time_ps, what});
    }
    return events;
  }

  // The middle of the tap that a time falls into.
  static std::int64_t middle_of_tap(std::int64_t time_ps) {
    const std::int64_t edge = TtmEncoder::period_of(time_ps) * thirds_a_period;
    const std::int64_t before_edge = edge - 3 * time_ps;
    const std::int64_t pair = before_edge / 288 * 288;
    const bool is_short = before_edge - pair < 96;
    const std::int64_t begin = pair + (is_short ? 0 : 96);
    const std::int64_t end = std::min(pair + (is_short ? 96 : 288), thirds_a_period);
    return (edge + 1) / 3 - (begin + end) / 6;
  }

  void write(const std::string& name, const std::vector<Tag>& tags) const {
    const DeviceClock clock{SourceInfo{"made", false, 1.6e9}, host_clock()};
    recording::PtuWriter writer(bridged.folder.path(name), {}, clock, true);
    writer.write(tags);
    writer.close();
  }

  [[nodiscard]] std::string config(const std::string& source, double period_ps) const {
    return bridged.write_config(source, "1", period_ps, test::short_frames);
  }

  void expect_the_same_frames(const std::vector<Tag>& recorded, double period_ps) {
    std::vector<Tag> tags = seen(recorded);
    for (Tag& tag : tags) tag.time_ps = middle_of_tap(tag.time_ps);
    sort(tags);
    write("recording.ptu", tags);
    const std::string recording = bridged.folder.path("recording.ptu");
    std::vector<std::string> expected = test::replayed(
        recording, config(R"({"driver":"replay","recording":")" + recording + "\"}", period_ps));
    ASSERT_GT(expected.size(), 20U);
    expected.pop_back();  // ends with the recording: a live stream would go on
    test::StreamFirmware firmware(supply(sent(tags, calibrating_light())));
    test::UsbDouble device({{0x04b4, 0x00f1}, "TTM-5"}, firmware);
    firmware.set_silent(true);
    device.plug();
    setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
    setenv("ASAN_OPTIONS", "verify_asan_link_order=0:detect_leaks=0", 1);
    std::vector<std::string> frames =
        test::live(config(R"({"driver":"brighteyes-ttm"})", period_ps), expected.size() + 1,
                   [&](const test::Program& splid) {
                     EXPECT_TRUE(test::says(splid, "TTM-5"));
                     firmware.set_silent(false);
                   });
    unsetenv("LD_PRELOAD");
    unsetenv("ASAN_OPTIONS");
    frames.erase(frames.begin());  // of the calibrating light
    ASSERT_EQ(frames.size(), expected.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      nlohmann::json frame = json_value(frames[i]);
      frame["sequence"] = i;
      EXPECT_EQ(frame.dump(), expected[i]);
    }
  }

  test::BridgedRun bridged;
};

TEST_F(TtmRecording, ALasersTimesComeToWithinATap) {
  expect_the_same_times(test::LaserRecording::tags());
}

TEST_F(TtmRecording, ALasersFramesAreThoseOfItsReplay) {
  expect_the_same_frames(test::LaserRecording::tags(), test::LaserRecording::period_ps);
}

TEST_F(TtmRecording, AQutagsTimesComeToWithinATap) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  expect_the_same_times(test::ptu_tags(file));
}

TEST_F(TtmRecording, AQutagsFramesAreThoseOfItsReplay) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  expect_the_same_frames(test::ptu_tags(file), 12512.62584);
}

}  // namespace
}  // namespace splid
