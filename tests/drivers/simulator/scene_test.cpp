#include "drivers/simulator/scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <stop_token>
#include <vector>

#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

using test::noiseless_scene;
using test::one_segment;
using test::paper_pattern;
using test::simulate;
using test::times_ps;

bool by_time(const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }

Options busy_scene() {
  Options options;
  options.pace = Speed::max;
  options.seconds = 0.1;
  options.encoder_rate_hz = 10'000;
  options.encoder_start_s = 0;
  options.sync.doubled_fraction = 0.1;
  options.sync.missing_fraction = 0.1;
  return options;
}

TEST(Scene, TagsAreSortedAndOfAllKinds) {
  const std::vector<Tag> tags = simulate(busy_scene(), paper_pattern());
  EXPECT_TRUE(std::is_sorted(tags.begin(), tags.end(), by_time));
  EXPECT_GT(times_ps(tags, TagKind::photon).size(), 15'000U);
  EXPECT_GT(times_ps(tags, TagKind::sync).size(), 25'000U);
  EXPECT_EQ(times_ps(tags, TagKind::marker).size(), 1000U);
  EXPECT_GE(tags.front().time_ps, 0);
  EXPECT_LE(tags.back().time_ps, 100'000'000'000);
}

TEST(Scene, SmallRoomsInTheSinkChangeNothing) {
  const Pattern pattern = paper_pattern();
  SourceContext context;
  context.pattern = &pattern;
  test::VectorSink sink(3);
  busy_scene().open(context)->run(sink, {});
  EXPECT_EQ(sink.tags, simulate(busy_scene(), pattern));
}

TEST(Scene, OneSeedGivesOneStream) {
  Options options = busy_scene();
  const std::vector<Tag> first = simulate(options, paper_pattern());
  EXPECT_EQ(first, simulate(options, paper_pattern()));
  options.seed = 2;
  EXPECT_NE(first, simulate(options, paper_pattern()));
}

TEST(Scene, AnOptionLeavesTheOtherStreamsAlone) {
  Options options = busy_scene();
  const auto before = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  options.sync.doubled_fraction = 0;
  options.encoder_rate_hz = 0;
  EXPECT_EQ(times_ps(simulate(options, paper_pattern()), TagKind::photon), before);
}

TEST(Scene, AnotherStartOfTheClockGivesTheSameStreamShifted) {
  Options options = busy_scene();
  std::vector<Tag> early = simulate(options, paper_pattern());
  options.start_ps = 340'000'000'000'000'123;
  for (Tag& tag : early) tag.time_ps += options.start_ps;
  EXPECT_EQ(simulate(options, paper_pattern()), early);
}

// Without noise each photon is at a pulse of one of the two targets, as many as each one's light
// makes, and the first target's photons are those of a scene without the second.
TEST(Scene, TargetsSendBackTheirOwnLight) {
  const Pattern pattern = paper_pattern();
  Options options = noiseless_scene();
  options.target.motion = MotionKind::linear;
  const auto of_first = times_ps(simulate(options, pattern), TagKind::photon);
  options.more_targets.resize(1);
  options.more_targets[0].path.motion = MotionKind::linear;
  options.more_targets[0].path.distance_m = options.target.distance_m - 1;
  options.more_targets[0].signal_per_pulse = 27e-4;
  const std::vector<Tag> tags = simulate(options, pattern);
  EXPECT_TRUE(std::is_sorted(tags.begin(), tags.end(), by_time));
  const auto all = times_ps(tags, TagKind::photon);
  std::vector<std::int64_t> of_second;
  std::set_difference(all.begin(), all.end(), of_first.begin(), of_first.end(),
                      std::back_inserter(of_second));
  EXPECT_EQ(of_second.size() + of_first.size(), all.size());
  const double expected = 27e-4 * 40 * 0.05 / 3.78e-6;
  EXPECT_NEAR(static_cast<double>(of_second.size()), expected, 5 * std::sqrt(expected));
  std::vector<std::int64_t> arrivals;
  const double way_ps = 2 * options.more_targets[0].path.distance_m / 299'792'458e-12;
  for (const double pulse : pattern.segments[0].pulse_times_ps) {
    arrivals.push_back(std::llround(pulse + way_ps) % 3'780'000);
  }
  std::sort(arrivals.begin(), arrivals.end());
  for (const std::int64_t time : of_second) {
    const std::int64_t phase = time % 3'780'000;
    const auto next = std::lower_bound(arrivals.begin(), arrivals.end(), phase - 2);
    ASSERT_TRUE(next != arrivals.end() && *next <= phase + 2) << phase;
  }
}

// Fog and foreign light come on top of what the scene has without them.
TEST(Scene, FogAndForeignLightAddTheirOwnPhotons) {
  Options options = busy_scene();
  const auto before = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  options.fog.counts_per_pulse = 0.02;
  options.foreign.counts_per_s = 160'000;
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  EXPECT_TRUE(std::is_sorted(tags.begin(), tags.end(), by_time));
  const auto all = times_ps(tags, TagKind::photon);
  std::vector<std::int64_t> more;
  std::set_difference(all.begin(), all.end(), before.begin(), before.end(),
                      std::back_inserter(more));
  EXPECT_EQ(more.size() + before.size(), all.size());
  const double expected = 0.02 * 40 * 0.1 / 3.78e-6 + 16'000;
  EXPECT_NEAR(static_cast<double>(more.size()), expected, 4 * std::sqrt(expected));
}

TEST(Scene, BackgroundIsPoisson) {
  Options options = noiseless_scene();
  options.detection.signal_per_pulse = 0;
  options.ambient_per_s = 1.5e6;
  options.dark_per_s = 0.5e6;
  options.seconds = 0.1;
  const auto times = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  // Variance of the counts in 1 us cells over their mean: 1, to within 4 standard deviations.
  constexpr int cells = 100'000;
  std::vector<double> counts(cells);
  for (const std::int64_t time : times) counts[static_cast<std::size_t>(time / 1'000'000)] += 1;
  double squares = 0;
  for (const double count : counts) squares += (count - 2) * (count - 2);
  EXPECT_NEAR(static_cast<double>(times.size()), 200'000, 4 * std::sqrt(200'000));
  EXPECT_NEAR(squares / cells / 2, 1, 4 * std::sqrt(2.5 / cells));
}

TEST(Scene, NoTargetLeavesTheBackground) {
  Options options = busy_scene();
  options.detection.signal_per_pulse = 0;
  const auto times = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  EXPECT_NEAR(static_cast<double>(times.size()), 17'500, 4 * std::sqrt(17'500));
}

TEST(Scene, NothingAtAllStillHasSyncsAndHeartbeats) {
  Options options = noiseless_scene();
  options.detection.signal_per_pulse = 0;
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  EXPECT_TRUE(times_ps(tags, TagKind::photon).empty());
  EXPECT_EQ(times_ps(tags, TagKind::sync).size(), 13'228U);
  EXPECT_EQ(times_ps(tags, TagKind::heartbeat).size(), 10U);
  EXPECT_EQ(tags.back(), heartbeat_tag(50'000'000'000));
}

TEST(Scene, MarkersComeAtTheEncodersRateFromItsStart) {
  Options options = noiseless_scene();
  options.encoder_rate_hz = 3000;
  options.encoder_start_s = 0.01;
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  const auto markers = times_ps(tags, TagKind::marker);
  ASSERT_EQ(markers.size(), 120U);
  for (std::size_t k = 0; k < markers.size(); ++k) {
    EXPECT_NEAR(static_cast<double>(markers[k]), 1e10 + static_cast<double>(k) * 1e12 / 3000, 1);
  }
}

TEST(Scene, PhotonsCarryTheirInput) {
  Options options = busy_scene();
  options.photon_input = 7;
  for (const Tag& tag : simulate(options, paper_pattern())) {
    ASSERT_EQ(tag.value, tag.kind == TagKind::photon ? 7 : tag.kind == TagKind::marker ? 1 : 0);
  }
}

// As the instruments do that filter their syncs: the first one after a photon passes.
TEST(Scene, SyncsNearPhotonsOnly) {
  Options options = noiseless_scene();
  options.ambient_per_s = 20'000;
  const std::vector<Tag> all = simulate(options, paper_pattern());
  std::vector<Tag> expected;
  bool photon = false;
  for (const Tag& tag : all) {
    if (tag.kind != TagKind::sync || photon) expected.push_back(tag);
    if (tag.kind == TagKind::sync) photon = false;
    if (tag.kind == TagKind::photon) photon = true;
  }
  options.sync.near_photons_only = true;
  const std::vector<Tag> filtered = simulate(options, paper_pattern());
  EXPECT_EQ(filtered, expected);
  EXPECT_LT(filtered.size(), all.size() / 2);
}

TEST(Scene, SegmentsInTurnGiveTheirPulses) {
  Pattern pattern;
  pattern.mode = Mode::mrr;
  pattern.segments = {{100'000, {0}, {1}, 5}, {90'000, {0}, {1}, 4}};
  Options options = noiseless_scene();
  options.target.amplitude_m = 0;
  options.target.distance_m = 3;
  options.detection.signal_per_pulse = 0.2;
  const auto delay_ps = std::llround(6 / 299'792'458e-12);
  for (const std::int64_t time : times_ps(simulate(options, pattern), TagKind::photon)) {
    const std::int64_t phase_ps = (time - delay_ps + 860'000) % 860'000;
    const bool first = phase_ps < 500'000;
    ASSERT_EQ(first ? phase_ps % 100'000 : (phase_ps - 500'000) % 90'000, 0) << time;
  }
}

TEST(Scene, AStopEndsItInTheMiddle) {
  const Pattern pattern = paper_pattern();
  SourceContext context;
  context.pattern = &pattern;
  std::stop_source stop;
  test::VectorSink sink(100, stop.get_token());
  sink.on_publish = [&](test::VectorSink& self) {
    if (self.tags.size() > 1000) stop.request_stop();
  };
  Options options = busy_scene();
  options.seconds = 0;
  options.open(context)->run(sink, stop.get_token());
  EXPECT_GT(sink.tags.size(), 1000U);
  EXPECT_LT(sink.tags.size(), 1200U);
}

}  // namespace
}  // namespace splid::simulator
