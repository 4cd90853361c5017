#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/stream.hpp"
#include "tests/support/field_scene.hpp"
#include "tests/support/framed.hpp"

// Several pixels from tags to estimates: framer, lanes and estimation threads.

namespace splid {
namespace {

using testing::ElementsAreArray;

ChannelOptions inputs_1_to(std::int64_t count) {
  ChannelOptions channels;
  for (std::int64_t input = 1; input <= count; ++input) channels.pixels.push_back(input);
  return channels;
}

ChannelOptions one_input(std::int64_t input) {
  ChannelOptions channels;
  channels.photon = {std::to_string(input)};
  return channels;
}

// Inputs 1 and 2 by turns, and input 3 once in ten photons.
std::vector<Tag> three_inputs() {
  test::TagStream stream;
  stream.photons_per_ms = 400;
  std::vector<Tag> tags = stream.make();
  int n = 0;
  for (Tag& tag : tags) {
    if (tag.kind == TagKind::photon) tag.value = ++n % 10 == 0 ? 3 : 1 + n % 2;
  }
  return tags;
}

// A frame's photons, in words that tell where two frames differ.
std::string words(const Frame& frame) {
  std::string text = std::to_string(frame.start_ps) + " to " + std::to_string(frame.end_ps) +
                     ", lost " + std::to_string(frame.lost_tags) + ", seen " +
                     std::to_string(frame.seen_fraction) + ":";
  for (const Loss& loss : frame.losses.view()) {
    text += " loss " + std::to_string(loss.begin_ps) + "-" + std::to_string(loss.end_ps);
  }
  text += ", before";
  for (const std::int64_t photon_ps : frame.before_ps.view())
    text += " " + std::to_string(photon_ps);
  text += ", photons";
  for (const std::int64_t photon_ps : frame.photons_ps.view())
    text += " " + std::to_string(photon_ps);
  return text;
}

std::vector<std::string> parts_of(const test::Framed& framed, std::size_t pixel) {
  std::vector<std::string> all;
  for (const auto& frame : framed.frames.frames) all.push_back(words(*frame->pixels.at(pixel)));
  return all;
}

std::vector<std::string> frames_of(const test::Framed& framed) {
  std::vector<std::string> all;
  for (const auto& frame : framed.frames.frames) all.push_back(words(*frame));
  return all;
}

FrameCapacity room_for(std::size_t pixels, std::size_t photons = 1 << 14) {
  FrameCapacity capacity = test::room_enough;
  capacity.pixels = pixels;
  capacity.photons = photons;
  return capacity;
}

void expect_pixel_sums_close(const test::Framed& r, std::uint64_t events) {
  EXPECT_EQ(r.totals.events, events);
  std::uint64_t photons = 0;
  std::uint64_t lost = 0;
  for (const auto& frame : r.frames.frames) {
    photons += frame->photon_count();
    lost += frame->lost_tags;
  }
  EXPECT_EQ(photons, r.totals.photons);
  EXPECT_EQ(lost + r.totals.unplaced, r.totals.late + r.totals.surplus + r.totals.reported);
  EXPECT_EQ(r.totals.events, r.totals.photons + r.totals.syncs + r.totals.markers -
                                 r.totals.shared + r.totals.ignored + r.totals.late +
                                 r.totals.surplus);
}

TEST(PixelsFramer, APixelsPartIsTheFrameOfItsInputAlone) {
  std::vector<Tag> tags = three_inputs();
  // A loss and late tags in the middle are of all pixels.
  const std::size_t middle = tags.size() / 2;
  const std::int64_t at_ps = tags[middle].time_ps;
  tags.insert(tags.begin() + static_cast<std::ptrdiff_t>(middle),
              {{at_ps, 0, TagKind::loss_begin, {}}, {at_ps + 1000, 5, TagKind::loss_end, {}}});
  for (const std::size_t block : {std::size_t{1}, std::size_t{1000}, tags.size()}) {
    const test::Framed field =
        test::framed(tags, block, room_for(3), test::options_of_10_ms(), inputs_1_to(3));
    expect_pixel_sums_close(field, test::events_in(tags));
    EXPECT_GT(field.frames.size(), 5U);
    for (std::int64_t input = 1; input <= 3; ++input) {
      const test::Framed alone =
          test::framed(tags, block, test::room_enough, test::options_of_10_ms(), one_input(input));
      EXPECT_EQ(parts_of(field, static_cast<std::size_t>(input) - 1), frames_of(alone)) << input;
    }
  }
}

// Input 1 has ten times as many photons as there is room for.
TEST(PixelsFramer, APixelThatNeverStopsCostsTheOthersNothing) {
  test::TagStream stream;
  stream.photons_per_ms = 1000;
  std::vector<Tag> tags = stream.make();
  int n = 0;
  for (Tag& tag : tags) {
    if (tag.kind == TagKind::photon) tag.value = ++n % 20 == 0 ? 2 : 1;
  }
  const test::Framed field =
      test::framed(tags, 1000, room_for(2, 1001), test::options_of_10_ms(), inputs_1_to(2));
  expect_pixel_sums_close(field, test::events_in(tags));
  EXPECT_GT(field.totals.surplus, 50'000U);
  const test::Framed alone =
      test::framed(tags, 1000, test::room_enough, test::options_of_10_ms(), one_input(2));
  EXPECT_EQ(parts_of(field, 1), frames_of(alone));
  const Frame& frame = field.frames[3];
  const Frame& hot = *frame.pixels[0];
  EXPECT_EQ(frame.seen_fraction, 1);
  EXPECT_EQ(hot.photons_ps.size(), 1000U);
  ASSERT_EQ(hot.losses.size(), 1U);
  EXPECT_EQ(hot.losses[0].begin_ps, hot.photons_ps[999] + 1);
  EXPECT_EQ(hot.losses[0].end_ps, frame.end_ps);
  EXPECT_EQ(hot.lost_tags, frame.lost_tags);
  EXPECT_NEAR(hot.seen_fraction, 1000 / 9500.0, 0.02);
}

TEST(PixelsFramer, RoomGrowsWhereTheSourceCanWait) {
  const std::vector<Tag> tags = three_inputs();
  FrameCapacity capacity = room_for(3, 8);
  capacity.most_photons = 1 << 16;
  const test::Framed field =
      test::framed(tags, 1000, capacity, test::options_of_10_ms(), inputs_1_to(3));
  EXPECT_EQ(field.totals.surplus, 0U);
  expect_pixel_sums_close(field, test::events_in(tags));
  EXPECT_EQ(parts_of(field, 2), frames_of(test::framed(tags, 1000, test::room_enough,
                                                       test::options_of_10_ms(), one_input(3))));
}

TEST(PixelsFramer, TakesOffEachPixelsDelay) {
  ChannelOptions channels = inputs_1_to(2);
  channels.delays_ps = {0, 300};
  const test::Framed field = test::framed({sync_tag(0), photon_tag(1000, 1), photon_tag(1300, 2)},
                                          10, room_for(2), test::options_of_10_ms(), channels);
  EXPECT_EQ(field.frames[0].pixels[0]->photons_ps[0], 1000);
  EXPECT_EQ(field.frames[0].pixels[1]->photons_ps[0], 1000);
}

// Each frame of each pixel, as it would be published.
std::vector<std::vector<std::string>> messages_of(const Config& config, std::vector<Tag> tags) {
  Stream stream(stream_options(config), test::script(std::move(tags)), host_clock());
  const FrameContext context = frame_context(config);
  std::vector<std::vector<std::string>> all(std::max<std::size_t>(config.pixels.size(), 1));
  const auto add = [&](const EstimationUnit& unit, const Frame& frame, const Estimate& estimate,
                       std::size_t pixel) {
    all[pixel].push_back(repeatable(to_json(
        make_frame_message(frame, estimate, context, {unit.mid_unix_s, 0, -1, unit.effort}))));
  };
  stream.start();
  while (!stream.ended()) {
    const EstimationUnit* unit = stream.next();
    if (unit == nullptr) {
      stream.wait(std::chrono::milliseconds{50});
      continue;
    }
    if (unit->pixels.empty()) add(*unit, unit->frame, unit->estimate, 0);
    for (std::size_t p = 0; p < unit->pixels.size(); ++p) {
      add(*unit, *unit->frame.pixels[p], unit->pixels[p].estimate, p);
    }
    stream.release();
  }
  EXPECT_EQ(stream.join(), nullptr);
  return all;
}

TEST(PixelsStream, SixteenInputsHaveTheBitsOfSixteenReplaysOfOne) {
  constexpr std::size_t pixels = 16;
  Config config = scene_config(0);
  config.estimator.tracked = true;
  const std::vector<Tag> tags = test::field_tags(pixels, 0.16, config.pattern);
  std::vector<PixelOptions> list = test::pixels_of(pixels);
  // Kinds of pixels, and one that never counts.
  for (std::size_t p = 0; p < pixels; p += 3) list[p].sigma_ps = 90;
  for (std::size_t p = 0; p < pixels; p += 5) list[p].dead_time_ns = 30;
  list[7].input = 99;
  std::vector<std::vector<std::string>> alone;
  for (const PixelOptions& pixel : list) {
    Config one = scene_config(0);
    one.estimator.tracked = true;
    one.channels.photon = {std::to_string(pixel.input)};
    one.pulse.sigma_ps = pixel.sigma_ps.value_or(one.pulse.sigma_ps);
    one.detector.dead_time_ns = pixel.dead_time_ns.value_or(one.detector.dead_time_ns);
    alone.push_back(messages_of(one, tags).at(0));
    EXPECT_GE(alone.back().size(), 3U);
  }
  EXPECT_THAT(alone[0][1], testing::HasSubstr("\"status\":\"ok\""));
  EXPECT_THAT(alone[7][1], testing::HasSubstr("\"photons\":0"));
  for (const std::int64_t threads : {1, 2, 4}) {
    Config field = test::with_pixels(scene_config(0, threads), list);
    field.estimator.tracked = true;
    EXPECT_THAT(messages_of(field, tags), ElementsAreArray(alone)) << threads;
  }
}

TEST(PixelsStream, OnePixelIsAsTheInputThatItHas) {
  const Config config = scene_config(0);
  const std::vector<Tag> tags = test::field_tags(1, 0.16, config.pattern);
  EXPECT_EQ(messages_of(test::with_pixels(scene_config(0), test::pixels_of(1)), tags),
            messages_of(config, tags));
}

}  // namespace
}  // namespace splid
