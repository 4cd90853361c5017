#include "daemon/service/measuring.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/output/publisher.hpp"
#include "daemon/stream/open_source.hpp"
#include "protocol/error.hpp"
#include "protocol/scene_json.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/field_scene.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/scripted_source.hpp"
#include "tests/support/yardstick.hpp"

// Streams that come and go as they are asked for, without a control socket around them.

namespace splid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Each source that it opens sends what makes two frames and the begin of a third, and then waits;
// where the instrument is unplugged there is no source to open.
struct ScriptedOptions final : SourceOptions {
  explicit ScriptedOptions(std::atomic<bool>& is_unplugged) : unplugged(is_unplugged) {}
  void describe(OptionVisitor& /*visitor*/) override {}
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& /*context*/) const override {
    if (unplugged) throw Error(Fault::device, "no instrument is plugged in");
    std::vector<Tag> tags;
    for (std::int64_t i = 0; i < 30'000; ++i) tags.push_back(sync_tag(i * 3'780'000));
    return std::make_unique<ScriptedSource>(std::move(tags), SourceInfo{"scripted", true, {}},
                                            ScriptedSource::End::until_stopped);
  }
  std::atomic<bool>& unplugged;
};

class MeasuringTest : public ::testing::Test {
 protected:
  explicit MeasuringTest(std::size_t pixels = 1) : pixel_count(pixels) {}
  ~MeasuringTest() override { stop.request_stop(); }

  void run() {
    thread = std::jthread([this] { (void)measuring.run(open_scene(config), stop.get_token()); });
  }
  bool comes_true(const std::function<bool()>& condition) const {
    const auto deadline = std::chrono::steady_clock::now() + test::patience;
    while (!condition() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
    return condition();
  }

  static std::vector<std::string> names_of(const SceneMessage& scene) {
    std::vector<std::string> names;
    for (const SceneMessage::Pixel& pixel : scene.pixels) names.push_back(pixel.name);
    return names;
  }

  const std::size_t pixel_count;
  std::atomic<bool> unplugged{false};
  Config config = [this] {
    Config made = scene_config(0);
    if (pixel_count > 1) made = test::with_pixels(std::move(made), test::pixels_of(pixel_count));
    made.source = std::make_unique<ScriptedOptions>(unplugged);
    return made;
  }();
  std::stop_source stop;
  std::set<std::vector<std::string>> names_seen;  // on the thread of run()
  std::atomic<std::uint64_t> frames{0};
  std::atomic<bool> in_a_row{true};
  DeviceMonitor device;
  Publisher publisher{config.publish.endpoint, 100};
  Output output{output_options(config),
                {publisher, &device, nullptr,
                 [this](const FrameMessage& frame, const std::string& json) {
                   if (frame.sequence != frames) in_a_row = false;
                   if (pixel_count > 1) names_seen.insert(names_of(scene_from_json(json)));
                   ++frames;
                   return true;
                 }},
                host_clock()};
  Measuring measuring{config, output, device, true};
  std::jthread thread;  // ends before what it uses
};

// docs: a pause takes 500 ms at most.
TEST_F(MeasuringTest, APauseClosesTheSourceAndFramesAreNumberedOnAcrossIt) {
  const test::Yardstick yardstick;
  run();
  std::vector<double> paused_ms;
  for (std::uint64_t round = 1; round <= 3; ++round) {
    ASSERT_TRUE(comes_true([&] { return frames >= 3 * round - 1; }));
    EXPECT_TRUE(measuring.measures());
    EXPECT_FALSE(measuring.start(stop.get_token()));  // it does already
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_TRUE(measuring.pause("the laser is off", stop.get_token()));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    paused_ms.push_back(took.count());
    EXPECT_FALSE(measuring.measures());
    EXPECT_EQ(frames, 3 * round);  // also the frame that was open
    EXPECT_FALSE(measuring.pause("for another reason", stop.get_token()));
    EXPECT_TRUE(measuring.start(stop.get_token()));
  }
  EXPECT_TRUE(in_a_row);
  EXPECT_TRUE(yardstick.keeps(500, test::median(paused_ms)));
}

TEST_F(MeasuringTest, ASourceThatDoesNotOpenIsToldToWhoAskedAndIsTriedWhenAskedAgain) {
  run();
  ASSERT_TRUE(comes_true([&] { return frames >= 2; }));
  EXPECT_TRUE(measuring.pause("the laser is off", stop.get_token()));
  unplugged = true;
  for (int i = 0; i < 2; ++i) {
    try {
      (void)measuring.start(stop.get_token());
      ADD_FAILURE() << "it measures";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::device);
      EXPECT_THAT(error.what(), HasSubstr("no instrument is plugged in"));
    }
    EXPECT_FALSE(measuring.measures());
  }
  unplugged = false;
  EXPECT_TRUE(measuring.start(stop.get_token()));
  EXPECT_TRUE(comes_true([&] { return frames >= 5; }));
}

// As while it measures: what the estimator refuses is told to who asked, and is not in use later.
TEST_F(MeasuringTest, AReloadThatIsRefusedDuringAPauseKeepsNoStreamFromBeginning) {
  run();
  ASSERT_TRUE(comes_true([&] { return frames >= 2; }));
  EXPECT_TRUE(measuring.pause("the laser is off", stop.get_token()));
  Config next = scene_config(0);
  next.estimator.method = Method::paper;
  next.scene.targets = 2;
  EXPECT_THAT(test::error_text([&] { measuring.reload(next, {}); }),
              HasSubstr("scene.json: /estimator/method: is \"paper\", but scene.targets is 2"));
  EXPECT_TRUE(measuring.start(stop.get_token()));
  EXPECT_TRUE(comes_true([&] { return frames >= 5; }));
  EXPECT_THAT(test::error_text([&] { measuring.reload(next, {}); }),
              HasSubstr("/estimator/method"));
}

class MeasuringPixelsTest : public MeasuringTest {
 protected:
  MeasuringPixelsTest() : MeasuringTest(2) {}
};

TEST_F(MeasuringPixelsTest, AReloadKeepsThePixelsThatTakeARestart) {
  run();
  ASSERT_TRUE(comes_true([&] { return frames >= 2; }));
  Config next = test::with_pixels(config, test::pixels_of(3));
  next.pixels[0].name = "other";
  next.scene.max_speed_mps = 15;
  measuring.reload(next, {});
  EXPECT_TRUE(measuring.pause("the laser is off", stop.get_token()));
  EXPECT_TRUE(measuring.start(stop.get_token()));
  EXPECT_TRUE(comes_true([&] { return frames >= 5; }));
  stop.request_stop();
  thread.join();
  EXPECT_THAT(names_seen, ElementsAre(ElementsAre("1", "2")));
}

TEST_F(MeasuringTest, AfterItsEndNobodyWaits) {
  run();
  ASSERT_TRUE(comes_true([&] { return frames >= 2; }));
  stop.request_stop();
  thread.join();
  EXPECT_FALSE(measuring.measures());
  EXPECT_THROW((void)measuring.pause("the laser is off", {}), Error);
  EXPECT_THROW((void)measuring.start({}), Error);
}

TEST_F(MeasuringTest, WithoutAFolderNothingIsRecordedAndThatIsSaid) {
  EXPECT_FALSE(measuring.records());
  try {
    (void)measuring.record();
    ADD_FAILURE() << "it records";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    EXPECT_THAT(error.what(), HasSubstr("/record/folder"));
  }
}

}  // namespace
}  // namespace splid
