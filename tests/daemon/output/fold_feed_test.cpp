#include "daemon/output/fold_feed.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/measured_stream.hpp"
#include "tests/support/patience.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;
using test::MeasuredStream;
using testing::ElementsAreArray;

bool comes_to_be(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + test::patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(milliseconds{5});
  }
  return true;
}

// A unit as a stream hands it on: syncs, and a photon in each tenth period.
EstimationUnit steady_unit() {
  constexpr std::int64_t period_ps = 3'780'000;
  constexpr std::int64_t periods = 13'228;
  EstimationUnit unit({});
  unit.frame.end_ps = periods * period_ps;
  for (std::int64_t i = 0; i < periods; i += 10) {
    unit.frame.photons_ps.room().front() = i * period_ps + 1000 + i;
    unit.frame.photons_ps.grow(1);
  }
  unit.frame.sync.locked = true;
  unit.frame.sync.period_ps = period_ps;
  unit.estimate.status = FrameStatus::no_target;
  unit.estimate.photons = unit.frame.photons_ps.size();
  return unit;
}

class Folds : public ::testing::Test {
 protected:
  std::optional<nlohmann::json> next_fold(sockets::Subscriber& subscriber) {
    std::optional<nlohmann::json> fold;
    comes_to_be([&] {
      const auto message = subscriber.receive(milliseconds{5});
      if (message && message->topic == "fold") fold = json_value(message->json);
      return fold.has_value();
    });
    return fold;
  }

  Config config = scene_config(0.5);
  Publisher publisher{"tcp://127.0.0.1:*", 1000};
  HeldClock clock;
};

TEST_F(Folds, AreWantedWhileSomebodySubscribesToThemByName) {
  const sockets::Subscriber all(publisher.endpoint(), {""});
  const sockets::Subscriber frames(publisher.endpoint(), {"frame", "f"});
  ASSERT_TRUE(publisher.wait_for_subscriber(test::patience));
  EXPECT_FALSE(publisher.fold_is_wanted());
  {
    const sockets::Subscriber first(publisher.endpoint(), {"fold"});
    EXPECT_TRUE(comes_to_be([&] { return publisher.fold_is_wanted(); }));
    std::optional<sockets::Subscriber> second(std::in_place, publisher.endpoint(),
                                              std::vector<std::string>{"fold"});
    second.reset();
    EXPECT_TRUE(publisher.fold_is_wanted());
  }
  EXPECT_TRUE(comes_to_be([&] { return !publisher.fold_is_wanted(); }));
}

TEST_F(Folds, ComeOnceASecondAtMost) {
  sockets::Subscriber subscriber(publisher.endpoint(), {"fold"});
  ASSERT_TRUE(comes_to_be([&] { return publisher.fold_is_wanted(); }));
  FoldFeed feed(fold_options(config), publisher, clock);
  const EstimationUnit unit = steady_unit();
  FrameMessage message;
  message.status = FrameStatus::no_target;
  for (std::uint64_t turn = 0; turn < 3; ++turn) {
    message.sequence = 10 * turn;
    // Offered again where the thread had only just published the last and was not yet back.
    std::optional<nlohmann::json> fold;
    ASSERT_TRUE(comes_to_be([&] {
      feed.frame_published(unit.frame, unit.estimate, message);
      const auto heard = subscriber.receive(milliseconds{20});
      if (heard && heard->topic == "fold") fold = json_value(heard->json);
      return fold.has_value();
    }));
    EXPECT_EQ((*fold)["sequence"], message.sequence);
    EXPECT_EQ((*fold)["status"], "no_target");
    EXPECT_EQ((*fold)["photons"], unit.frame.photons_ps.size());
    EXPECT_EQ((*fold)["folded"], unit.frame.photons_ps.size());
    EXPECT_EQ((*fold)["period"]["counts"].size(), 1024u);
    for (const std::int64_t early_ms : {0, 500, 499}) {
      clock.advance_ms(early_ms);
      ++message.sequence;
      std::this_thread::sleep_for(milliseconds{20});
      feed.frame_published(unit.frame, unit.estimate, message);
    }
    EXPECT_FALSE(subscriber.receive(milliseconds{100}));
    clock.advance_ms(1);
  }
}

TEST_F(Folds, OfVeryManyPhotonsAreMadeOfSome) {
  sockets::Subscriber subscriber(publisher.endpoint(), {"fold"});
  ASSERT_TRUE(comes_to_be([&] { return publisher.fold_is_wanted(); }));
  FoldFeed feed(fold_options(config), publisher, clock);
  EstimationUnit unit = steady_unit();
  while (unit.frame.photons_ps.size() <= FoldFeed::most_photons) {
    unit.frame.photons_ps.room().front() = static_cast<std::int64_t>(unit.frame.photons_ps.size());
    unit.frame.photons_ps.grow(1);
  }
  feed.frame_published(unit.frame, unit.estimate, {});
  const auto fold = next_fold(subscriber);
  ASSERT_TRUE(fold);
  EXPECT_EQ((*fold)["photons"], FoldFeed::most_photons + 1);
  EXPECT_EQ((*fold)["folded"], FoldFeed::most_photons / 2 + 1);
}

TEST_F(Folds, ThatCannotBeMadeAreMessagesWithoutPictures) {
  sockets::Subscriber subscriber(publisher.endpoint(), {"fold"});
  ASSERT_TRUE(comes_to_be([&] { return publisher.fold_is_wanted(); }));
  FoldFeed feed(fold_options(config), publisher, clock);
  PulseOptions tabulated;
  tabulated.shape = Shape::tabulated;  // the pattern has no table
  feed.reload(tabulated);
  const EstimationUnit unit = steady_unit();
  feed.frame_published(unit.frame, unit.estimate, {});
  const auto fold = next_fold(subscriber);
  ASSERT_TRUE(fold);
  EXPECT_FALSE(fold->contains("period"));
}

TEST_F(Folds, ChangeNoByteOfAFrameAndAreThoseOfAFrame) {
  const auto frames_with = [&](const std::vector<std::string>& topics, bool& folds) {
    std::map<std::uint64_t, std::string> frames;
    sockets::Subscriber subscriber(publisher.endpoint(), topics);
    const bool asks = topics.back() == "fold";
    EXPECT_TRUE(comes_to_be([&] { return publisher.fold_is_wanted() == asks; }));
    MeasuredStream measured(config, open_scene(config), publisher, host_clock());
    std::vector<std::string> lines;
    measured.observe([&](const FrameMessage& frame, const std::string& json) {
      frames[frame.sequence] = json;
      lines.push_back(repeatable(json));
      return true;
    });
    (void)measured.run({});
    folds = false;
    if (asks) {
      const auto fold = next_fold(subscriber);
      EXPECT_TRUE(fold);
      if (!fold) return lines;
      folds = true;
      const auto frame = json_value(frames.at((*fold)["sequence"]));
      for (const char* member : {"timestamp", "status", "photons"}) {
        EXPECT_EQ((*fold)[member], frame[member]) << member;
      }
      EXPECT_EQ((*fold)["plane"]["gain_nats"].size(), 4096u);
    } else {
      while (const auto message = subscriber.receive(milliseconds{200})) {
        folds |= message->topic == "fold";
      }
    }
    return lines;
  };
  bool folds = false;
  const auto without = frames_with({""}, folds);
  EXPECT_FALSE(folds);
  const auto with = frames_with({"frame", "fold"}, folds);
  EXPECT_TRUE(folds);
  EXPECT_THAT(with, ElementsAreArray(without));
  EXPECT_GE(with.size(), 9u);
}

}  // namespace
}  // namespace splid
