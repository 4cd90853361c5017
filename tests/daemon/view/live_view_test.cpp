#include "daemon/view/live_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_columns.hpp"
#include "protocol/json_value.hpp"
#include "protocol/scene_json.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/sanitized.hpp"

namespace splid::view {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

FrameMessage frame_at(double timestamp_s, double distance_m, FrameStatus status = FrameStatus::ok) {
  FrameMessage frame;
  frame.timestamp_s = timestamp_s;
  frame.status = status;
  frame.duration_ms = 50;
  frame.distance_m = distance_m;
  frame.std_distance_m = 0.25;
  frame.photons = 1000;
  frame.signal_per_period = 0.004;
  frame.sync = FrameMessage::Sync{};
  frame.sync->period_ps = 4e6;
  return frame;
}

// The data of the last event of that name; null: there is none.
json data_of(const std::string& events, const std::string& name) {
  const std::string head = "event: " + name + "\ndata: ";
  const auto at = events.rfind(head);
  if (at == std::string::npos) return nullptr;
  const auto begin = at + head.size();
  return json_value(events.substr(begin, events.find('\n', begin) - begin));
}

TEST(ViewHistory, ABinKeepsMeanAndReachWithTheDeviation) {
  History history(1000);  // bins of a second
  history.add(frame_at(100.1, 10), 0.5);
  history.add(frame_at(100.2, 12), 0.5);
  history.add(frame_at(101.0, 20, FrameStatus::no_target), 0.25);
  const json rows = json_value(history.rows_after(0));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0][0], 100);
  EXPECT_EQ(rows[0][1], 2);
  EXPECT_EQ(rows[0][2], 2);
  EXPECT_EQ(rows[0][3], static_cast<int>(FrameStatus::ok));
  EXPECT_EQ(rows[0][4], json({9.75, 11.0, 12.25}));
  EXPECT_EQ(rows[0][4 + static_cast<int>(Series::ring)], json({0.5}));
  EXPECT_EQ(rows[0][4 + static_cast<int>(Series::count_rate)], json({20'000.0}));
  EXPECT_EQ(rows[0][4 + static_cast<int>(Series::signal_rate)], json({1000.0}));
  EXPECT_EQ(rows[0].size(), 4 + series_count);
  // What is not valid has no distance, and says why.
  EXPECT_EQ(rows[1][1], 1);
  EXPECT_EQ(rows[1][2], 0);
  EXPECT_EQ(rows[1][3], static_cast<int>(FrameStatus::no_target));
  EXPECT_EQ(rows[1][4], 0);
  EXPECT_EQ(history.best(Series::distance), 12.25);
  EXPECT_FALSE(history.best(Series::drift));
}

TEST(ViewHistory, NeverHoldsMoreThanItsBinsWhateverComes) {
  History history(10);
  for (int i = 0; i < 200'000; ++i) history.add(frame_at(1.7e9 + 0.005 * i, i), 0);
  EXPECT_LE(history.bins().size(), 1000u);
  EXPECT_GE(history.bins().size(), 990u);
  EXPECT_EQ(history.epoch(), 0u);
  // A thinned outlier is still there.
  History hour(3600);
  for (int i = 0; i < 1000; ++i) hour.add(frame_at(1.7e9 + 0.05 * i, i == 500 ? 99 : 10), 0);
  EXPECT_EQ(hour.best(Series::distance), 99.25);
  EXPECT_LE(hour.bins().size(), 15u);
}

TEST(ViewHistory, BeginsAnewWithAnotherReplayButNotWithAClockSetBackALittle) {
  History history(10);
  history.add(frame_at(1000, 1), 0);
  history.add(frame_at(999.9, 2), 0);
  EXPECT_EQ(history.epoch(), 0u);
  ASSERT_EQ(history.bins().size(), 1u);
  EXPECT_EQ(history.bins().back().frames, 2u);
  history.add(frame_at(900, 3), 0);
  EXPECT_EQ(history.epoch(), 1u);
  ASSERT_EQ(history.bins().size(), 1u);
  EXPECT_EQ(history.bins().back().frames, 1u);
  for (const double no_date : {1e300, -1e300}) history.add(frame_at(no_date, 3), 0);
  EXPECT_EQ(history.bins().size(), 1u);
}

TEST(LiveView, AViewerGetsMessagesAsTheyCameAndEachOnce) {
  const HeldClock clock;
  LiveView view("tcp://127.0.0.1:9872", clock);
  StatusMessage status;
  status.ring_fill_ratio = 0.5;
  const std::string frame = to_json(frame_at(100, 10));
  view.take("version", to_json(VersionMessage{}));
  view.take("status", to_json(status));
  view.take("frame", frame);
  LiveView::Cursor cursor = LiveView::cursor(60);
  EXPECT_TRUE(view.has_news(cursor));
  const std::string first = view.news(cursor);
  EXPECT_THAT(first, HasSubstr("event: frame\ndata: " + frame + "\n\n"));
  EXPECT_THAT(first, HasSubstr("event: status\ndata: " + to_json(status) + "\n\n"));
  EXPECT_EQ(data_of(first, "bins")["anew"], true);
  EXPECT_EQ(data_of(first, "bins")["window_s"], 60);
  EXPECT_EQ(data_of(first, "page")["endpoint"], "tcp://127.0.0.1:9872");
  EXPECT_FALSE(view.has_news(cursor));
  EXPECT_THAT(view.news(cursor), IsEmpty());

  view.take("frame", to_json(frame_at(100.05, 11)));
  view.take("frame", to_json(frame_at(100.10, 12)));
  const std::string second = view.news(cursor);
  EXPECT_EQ(data_of(second, "frame")["distance_m"], 12);
  EXPECT_EQ(data_of(second, "bins")["anew"], false);
  EXPECT_THAT(second, Not(HasSubstr("event: status")));
  view.set_connection("nobody answers");
  EXPECT_EQ(data_of(view.news(cursor), "page")["trouble"], "nobody answers");
}

// However long the daemon has been silent, or its frames without a target, when the page is opened.
TEST(LiveView, ANewViewerGetsTheLastValidFrameAndItsAge) {
  HeldClock clock;
  LiveView view("ipc:///tmp/x", clock);
  LiveView::Cursor early = LiveView::cursor(10);
  EXPECT_THAT(view.news(early), Not(HasSubstr("event: past")));
  view.take("frame", to_json(frame_at(1000, 10)));
  clock.advance_ms(9000);
  view.take("frame", to_json(frame_at(1009, 11, FrameStatus::no_target)));
  clock.advance_ms(2500);
  LiveView::Cursor late = LiveView::cursor(10);
  const json past = data_of(view.news(late), "past");
  EXPECT_EQ(past["frame_age_s"], 2.5);
  EXPECT_EQ(past["valid_age_s"], 11.5);
  EXPECT_EQ(past["valid"]["distance_m"], 10);
  view.take("frame", to_json(frame_at(1010, 12)));
  EXPECT_THAT(view.news(late), Not(HasSubstr("event: past")));
}

TEST(FrameTable, HasEachFrameOfATimeUntilItIsNoLongerKept) {
  FrameTable table;
  const auto lines = [&](double from_s, double to_s) {
    const std::string csv = table.csv(from_s, to_s).value_or("");
    return std::count(csv.begin(), csv.end(), '\n');
  };
  EXPECT_EQ(table.csv(0, 10), frame_csv_head());
  for (int i = 0; i < 4; ++i) table.add(frame_at(100 + i, i));
  EXPECT_EQ(table.csv(102, 103),
            frame_csv_head() + frame_csv_row(frame_at(102, 2)) + frame_csv_row(frame_at(103, 3)));
  EXPECT_EQ(lines(0, 1e9), 5);
  table.add(frame_at(50, 0));  // another replay
  EXPECT_EQ(lines(0, 1e9), 2);
  for (std::size_t i = 0; i < FrameTable::most_frames; ++i) {
    table.add(frame_at(51 + static_cast<double>(i), 0));
  }
  EXPECT_EQ(table.csv(50, 60), std::nullopt);
  EXPECT_EQ(lines(51, 60), 11);
}

TEST(LiveView, AViewerThatFellBehindGetsTheNewestAndNoMore) {
  const HeldClock clock;
  LiveView view("ipc:///tmp/x", clock);
  LiveView::Cursor slow = LiveView::cursor(10);
  view.take("frame", to_json(frame_at(1000, 1)));
  view.news(slow);
  const int frames = test::times(20'000);
  for (int i = 1; i < frames; ++i) view.take("frame", to_json(frame_at(1000 + 0.05 * i, i)));
  const std::string news = view.news(slow);
  EXPECT_LT(news.size(), 300'000u);
  EXPECT_LE(data_of(news, "bins")["rows"].size(), 1000u);
  EXPECT_EQ(data_of(news, "frame")["distance_m"], frames - 1);
  // After another replay began, it is told to forget.
  view.take("frame", to_json(frame_at(10, 5)));
  EXPECT_EQ(data_of(view.news(slow), "bins")["anew"], true);
}

TEST(LiveView, TakesTheShortestHistoryThatHasTheSeconds) {
  const HeldClock clock;
  LiveView view("ipc:///tmp/x", clock);
  for (const auto& [seconds, window_s] : std::vector<std::pair<std::int64_t, int>>{
           {0, 10}, {10, 10}, {11, 30}, {3600, 3600}, {99'999, 3600}}) {
    LiveView::Cursor cursor = LiveView::cursor(seconds);
    EXPECT_EQ(data_of(view.news(cursor), "bins")["window_s"], window_s) << seconds;
  }
}

TEST(LiveView, CountsWhatItCannotReadAndLetsNoLineFeedThrough) {
  const HeldClock clock;
  LiveView view("ipc:///tmp/x", clock);
  view.take("frame", "{");
  view.take("status", "[]");
  view.take("version", "");
  view.take("status", std::string(1 << 20, ' '));
  EXPECT_EQ(view.unread(), 4u);
  view.take("status", "{\"state\":\n\n\"event: frame\"\r}");
  LiveView::Cursor cursor = LiveView::cursor(10);
  const std::string news = view.news(cursor);
  EXPECT_THAT(news, HasSubstr("data: {\"state\":  \"event: frame\" }\n\n"));
  EXPECT_EQ(data_of(news, "frame"), nullptr);
}

TEST(LiveView, PicturesOfThePhotonsGoToThoseWhoWantThemAndAreForgotten) {
  const HeldClock clock;
  LiveView view("ipc://x", clock);
  LiveView::Cursor plain = LiveView::cursor(10);
  LiveView::Cursor looker = LiveView::cursor(10);
  looker.wants_fold = true;
  view.news(plain);
  view.news(looker);
  view.take("fold", R"({"schema":"splid.fold","sequence":7})");
  EXPECT_FALSE(view.has_news(plain));
  EXPECT_TRUE(view.has_news(looker));
  EXPECT_THAT(view.news(plain), IsEmpty());
  EXPECT_EQ(data_of(view.news(looker), "fold")["sequence"], 7);
  EXPECT_FALSE(view.has_news(looker));
  view.take("fold", "no JSON");
  view.take("fold", std::string(1 << 19, ' ') + "{}");
  EXPECT_FALSE(view.has_news(looker));
  EXPECT_EQ(view.unread(), 2u);
  view.forget_fold();
  LiveView::Cursor next = LiveView::cursor(10);
  next.wants_fold = true;
  EXPECT_THAT(view.news(next), Not(HasSubstr("event: fold")));
}

// ---- several pixels

// Of the pixels a and b, each with this distance, b a metre farther.
SceneMessage two_pixels_at(double timestamp_s, double distance_m) {
  SceneMessage scene;
  scene.whole = frame_at(timestamp_s, 0);
  scene.whole.distance_m.reset();
  scene.whole.photons.reset();
  for (const char* name : {"a", "b"}) {
    FrameMessage frame = frame_at(timestamp_s, distance_m + (*name == 'b' ? 1 : 0));
    scene.pixels.push_back({name, {}, {}, frame});
  }
  return scene;
}

FrameMessage frame_of_pixel(const SceneMessage& scene, std::size_t index) {
  FrameMessage frame = scene.pixels[index].frame;
  frame.pixel = scene.pixels[index].name;
  return frame;
}

// The means of the distance in the bins.
std::vector<double> distances_in(const json& bins) {
  std::vector<double> distances;
  for (const json& row : bins["rows"]) {
    const json& reach = row[4];
    distances.push_back(reach.size() == 3 ? reach[1].get<double>() : -1);
  }
  return distances;
}

bool has_count_rate(const json& row) {
  return row[4 + static_cast<int>(Series::count_rate)].is_array();
}

TEST(LiveView, AViewerGetsThePictureOfAllPixelsAndTheTrackOfItsOwn) {
  const HeldClock clock;
  LiveView view("ipc://x", clock);
  LiveView::Cursor plain = LiveView::cursor(10);
  view.take("scene", to_json(two_pixels_at(1000, 20)));
  view.take("scene", to_json(two_pixels_at(1000.05, 21)));
  const std::string first = view.news(plain);
  EXPECT_EQ(data_of(first, "layout")["pixel"], json({"a", "b"}));
  EXPECT_EQ(data_of(first, "picture")["distance_m"], json({21, 22}));
  EXPECT_EQ(data_of(first, "frame"), nullptr);
  EXPECT_TRUE(data_of(first, "bins")["rows"].empty());
  EXPECT_THAT(view.looked_at(), IsEmpty());

  // It chooses b, and sees its past at once.
  LiveView::Cursor chosen = LiveView::cursor(10);
  view.look_at("b", chosen);
  EXPECT_THAT(view.looked_at(), testing::ElementsAre("b"));
  const std::string second = view.news(chosen);
  EXPECT_EQ(distances_in(data_of(second, "bins")), std::vector<double>({21, 22}));
  EXPECT_EQ(data_of(second, "frame")["distance_m"], 22);
  EXPECT_EQ(data_of(second, "frame")["pixel"], "b");
  EXPECT_EQ(data_of(second, "past")["valid"]["distance_m"], 22);
  EXPECT_FALSE(view.has_news(chosen));

  // The layout stays, and comes no more.
  const SceneMessage third = two_pixels_at(1000.1, 22);
  view.take("scene", to_json(third));
  view.take("frame/b", to_json(frame_of_pixel(third, 1)));
  const std::string more = view.news(chosen);
  EXPECT_THAT(more, Not(HasSubstr("event: layout")));
  EXPECT_EQ(data_of(more, "picture")["distance_m"], json({22, 23}));
  EXPECT_EQ(data_of(more, "frame")["photons"], 1000);
  chosen = LiveView::cursor(10);
  EXPECT_THAT(view.looked_at(), IsEmpty());
}

// The pixel's own message has more values than the scene, and may be lost.
TEST(LiveView, EachFrameOfAPixelCountsOnceFromItsOwnMessageOrFromTheScene) {
  const HeldClock clock;
  LiveView view("ipc://x", clock);
  LiveView::Cursor cursor = LiveView::cursor(10);
  view.look_at("a", cursor);
  for (int i = 0; i < 4; ++i) {
    const SceneMessage scene = two_pixels_at(1000 + 0.05 * i, 20 + i);
    view.take("scene", to_json(scene));
    if (i != 1) view.take("frame/a", to_json(frame_of_pixel(scene, 0)));
    view.take("frame/ab", to_json(frame_at(1000, 99)));  // begins as the topic does
  }
  const json rows = data_of(view.news(cursor), "bins")["rows"];
  EXPECT_EQ(distances_in({{"rows", rows}}), std::vector<double>({20, 21, 22, 23}));
  ASSERT_EQ(rows.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(rows[i][1], 1) << i;
    EXPECT_EQ(has_count_rate(rows[i]), i != 1) << i;
  }
}

TEST(LiveView, ADaemonMayComeBackWithOnePixelAndWithSeveralAgain) {
  const HeldClock clock;
  LiveView view("ipc://x", clock);
  LiveView::Cursor cursor = LiveView::cursor(10);
  view.look_at("a", cursor);
  view.take("scene", to_json(two_pixels_at(1000, 20)));
  view.take("scene", to_json(two_pixels_at(1000.05, 20)));
  view.news(cursor);
  view.take("frame", to_json(frame_at(1001, 10)));
  const std::string one = view.news(cursor);
  EXPECT_THAT(one, HasSubstr("event: layout\ndata: null\n\n"));
  EXPECT_EQ(data_of(one, "bins")["anew"], true);
  EXPECT_EQ(distances_in(data_of(one, "bins")), std::vector<double>({10}));
  EXPECT_EQ(data_of(one, "frame")["distance_m"], 10);
  view.take("scene", to_json(two_pixels_at(1002, 30)));
  const std::string several = view.news(cursor);
  EXPECT_EQ(data_of(several, "layout")["pixel"], json({"a", "b"}));
  EXPECT_EQ(data_of(several, "bins")["anew"], true);
  // Who has chosen none does not get the one pixel's old values.
  LiveView::Cursor plain = LiveView::cursor(10);
  EXPECT_EQ(data_of(view.news(plain), "frame"), nullptr);
}

TEST(LiveView, GivesTheFramesOfAPixelAsATable) {
  const HeldClock clock;
  LiveView view("ipc://x", clock);
  view.take("scene", to_json(two_pixels_at(1000, 20)));
  const std::string csv = view.frames_csv("b", 999, 1001).value_or("");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2);
  EXPECT_THAT(csv, AllOf(HasSubstr(",21,"), Not(HasSubstr(",20,"))));
}

TEST(LiveView, CountsScenesThatItCannotRead) {
  const HeldClock clock;
  LiveView view("ipc://x", clock);
  LiveView::Cursor cursor = LiveView::cursor(10);
  view.look_at("a", cursor);
  view.take("scene", "{");
  view.take("scene", std::string(1U << 21U, ' '));
  view.take("frame/a", "[]");
  view.take("frame/b", "[]");  // of nobody
  EXPECT_EQ(view.unread(), 3U);
  for (int i = 0; i < 1000; ++i) view.look_at("x" + std::to_string(i), cursor);
  EXPECT_EQ(view.looked_at().size(), 1U);
}

}  // namespace
}  // namespace splid::view
