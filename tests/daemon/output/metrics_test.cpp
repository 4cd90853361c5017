#include "daemon/output/metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/output/output.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/measured_stream.hpp"
#include "tests/support/metrics_text.hpp"
#include "tests/support/program.hpp"

namespace splid {
namespace {

using splid::test::file_text;
using splid::test::MetricsText;
using splid::test::TempFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const std::vector<SourceCounter> two_counters = {
    {"splid_usb_transfers_total", {{"status", "stall"}}, "transfers", 0},
    {"splid_usb_bytes_total", {}, "bytes", 0}};

class MetricsTest : public ::testing::Test {
 protected:
  Metrics make(const std::vector<SourceCounter>& counters = {}) {
    return {config.metrics, status_options(config), counters, clock,
            [this](const std::string& text) { notices.push_back(text); }};
  }

  Config config = scene_config(0.5);
  HeldClock clock;
  TempFolder folder;
  std::vector<std::string> notices;
};

TEST_F(MetricsTest, BeginAtZeroWithEverySeriesThere) {
  const Metrics metrics = make(two_counters);
  const MetricsText text(metrics.text());
  EXPECT_THAT(metrics.text(),
              HasSubstr(R"(splid_build_info{mode="interleaved",pattern="interleaved",version=")"));
  EXPECT_EQ(text.sum("splid_build_info"), 1);
  EXPECT_EQ(text("process_start_time_seconds"), 1.7e9 + 1);
  for (const char* status :
       {"ok", "no_target", "ambiguous", "incomplete", "no_sync", "saturated"}) {
    EXPECT_EQ(text(std::string("splid_frames_total{status=\"") + status + "\"}"), 0);
  }
  for (const char* cause : {"instrument", "ring", "late", "surplus", "discarded"}) {
    EXPECT_EQ(text(std::string("splid_tags_lost_total{cause=\"") + cause + "\"}"), 0);
  }
  EXPECT_EQ(text("splid_usb_transfers_total{status=\"stall\"}"), 0);
  EXPECT_EQ(text("splid_state{state=\"starting\"}"), 1);
  EXPECT_EQ(text("splid_measurement{state=\"none\"}"), 1);
  EXPECT_EQ(text("splid_device_state{state=\"connected\"}"), 1);
  EXPECT_TRUE(std::isnan(text("splid_sync_drift_ratio")));
  EXPECT_EQ(text.types.at("splid_frame_latency_seconds"), "histogram");
  EXPECT_EQ(text.types.at("splid_tags_total"), "counter");
  EXPECT_EQ(text.types.at("splid_ring_fill_ratio"), "gauge");
}

// The values stand while frames are not valid, and their age says so.
TEST_F(MetricsTest, HaveTheLastValidValuesAndTheirAge) {
  Metrics metrics = make();
  const auto values = [&] {
    const MetricsText text(metrics.text());
    std::vector<double> found;
    for (const char* name :
         {"splid_distance_meters", "splid_distance_std_meters", "splid_velocity_meters_per_second",
          "splid_velocity_std_meters_per_second", "splid_signal_counts_per_pulse",
          "splid_signal_std_counts_per_pulse", "splid_background_counts_per_second",
          "splid_background_std_counts_per_second", "splid_valid_frame_age_seconds"}) {
      found.push_back(text(name));
    }
    return found;
  };
  EXPECT_THAT(values(), testing::Each(testing::IsNan()));
  FrameMessage frame;
  frame.status = FrameStatus::ok;
  frame.distance_m = 284.5;
  frame.std_distance_m = 5e-4;
  frame.velocity_mps = -3;
  frame.std_velocity_mps = 0.02;
  frame.signal_per_pulse = 1.5e-3;
  frame.std_signal_per_pulse = 2e-5;
  frame.background_per_s = 2e5;
  frame.std_background_per_s = 1e3;
  metrics.frame_published(frame, false);
  frame.status = FrameStatus::saturated;
  frame.distance_m = 1;
  metrics.frame_published(frame, false);
  clock.advance_ms(2500);
  StatusMessage status;
  status.measurement = "saturated";
  metrics.refresh(status, {});
  EXPECT_THAT(values(), ElementsAre(284.5, 5e-4, -3, 0.02, 1.5e-3, 2e-5, 2e5, 1e3, 2.5));
  const MetricsText text(metrics.text());
  EXPECT_EQ(text("splid_measurement{state=\"saturated\"}"), 1);
  EXPECT_EQ(text.sum("splid_measurement"), 1);
}

TEST_F(MetricsTest, CountFramesInBaseUnits) {
  Metrics metrics = make();
  FrameMessage frame;
  frame.status = FrameStatus::ok;
  frame.latency_ms = 2;  // a bucket holds its own bound
  frame.compute_ms = 1.5;
  frame.sync = FrameMessage::Sync{9, 3, 2, {}, -12.5, 40};
  metrics.frame_published(frame, false);
  frame.status = FrameStatus::incomplete;
  frame.latency_ms = 7000;
  metrics.frame_published(frame, true);
  const MetricsText text(metrics.text());
  EXPECT_EQ(text("splid_frames_total{status=\"ok\"}"), 1);
  EXPECT_EQ(text("splid_frames_total{status=\"incomplete\"}"), 1);
  EXPECT_EQ(text.sum("splid_frames_total"), 2);
  EXPECT_EQ(text("splid_frames_effort_lowered_total"), 1);
  EXPECT_EQ(text("splid_frame_latency_seconds_bucket{le=\"0.001\"}"), 0);
  EXPECT_EQ(text("splid_frame_latency_seconds_bucket{le=\"0.002\"}"), 1);
  EXPECT_EQ(text("splid_frame_latency_seconds_bucket{le=\"1\"}"), 1);
  EXPECT_EQ(text("splid_frame_latency_seconds_count"), 2);
  EXPECT_DOUBLE_EQ(text("splid_frame_latency_seconds_sum"), 7.002);
  EXPECT_DOUBLE_EQ(text("splid_frame_compute_seconds_sum"), 0.003);
  EXPECT_EQ(text("splid_syncs_missing_total"), 6);
  EXPECT_EQ(text("splid_syncs_spurious_total"), 4);
  EXPECT_DOUBLE_EQ(text("splid_sync_drift_ratio"), -12.5e-6);
  EXPECT_DOUBLE_EQ(text("splid_sync_jitter_seconds"), 40e-12);
  frame.sync = FrameMessage::Sync{};
  frame.latency_ms.reset();
  metrics.frame_published(frame, false);
  EXPECT_TRUE(std::isnan(MetricsText(metrics.text())("splid_sync_drift_ratio")));
  EXPECT_EQ(MetricsText(metrics.text())("splid_frame_latency_seconds_count"), 2);
}

TEST_F(MetricsTest, TakeOverTheTotalsToTheLastTagAndNeverFall) {
  constexpr std::uint64_t largest = (1ULL << 53U) - 1;  // that a double holds, and the next too
  Metrics metrics = make(two_counters);
  StreamCounters counters;
  counters.framer = {.events = largest,
                     .photons = 2,
                     .syncs = 3,
                     .markers = 4,
                     .shared = 5,
                     .ignored = 6,
                     .late = 7,
                     .surplus = 8,
                     .reported = 5,
                     .unplaced = 0,
                     .frames = 1,
                     .jumps = 9,
                     .resets = 10,
                     .outside = 17};
  counters.dropped_tags = 1000;  // on its way down the stream
  counters.discarded_tags = 11;
  StatusMessage status;
  status.state = DaemonState::degraded;
  status.device = DeviceState::failing;
  metrics.ring_filled(0.75);
  metrics.ring_filled(0.25);
  counters.source = two_counters;
  counters.source[0].value = 12;
  counters.source[1].value = 13;
  metrics.refresh(status, counters);
  MetricsText text(metrics.text());
  EXPECT_EQ(text("splid_tags_read_total"), static_cast<double>(largest));
  EXPECT_THAT(metrics.text(), HasSubstr("splid_tags_read_total 9007199254740991\n"));
  EXPECT_EQ(text("splid_tags_total{channel=\"photon\"}"), 2);
  EXPECT_EQ(text("splid_tags_total{channel=\"sync\"}"), 3);
  EXPECT_EQ(text("splid_tags_total{channel=\"encoder\"}"), 4);
  EXPECT_EQ(text("splid_tags_total{channel=\"ignored\"}"), 6);
  EXPECT_EQ(text("splid_tags_total{channel=\"outside\"}"), 17);
  EXPECT_EQ(text("splid_tags_shared_total"), 5);
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"late\"}"), 7);
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"surplus\"}"), 8);
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"ring\"}"), 1000);
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"instrument\"}"), 0);
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"discarded\"}"), 11);
  EXPECT_EQ(text("splid_stream_jumps_total"), 9);
  EXPECT_EQ(text("splid_stream_resets_total"), 10);
  EXPECT_EQ(text("splid_ring_fill_ratio"), 0.75);
  EXPECT_EQ(text("splid_state{state=\"degraded\"}"), 1);
  EXPECT_EQ(text.sum("splid_state"), 1);
  EXPECT_EQ(text("splid_device_state{state=\"failing\"}"), 1);
  EXPECT_EQ(text.sum("splid_device_state"), 1);
  EXPECT_EQ(text("splid_usb_transfers_total{status=\"stall\"}"), 12);
  EXPECT_EQ(text("splid_usb_bytes_total"), 13);
  counters.framer.reported = 1005;
  metrics.refresh(status, counters);
  counters.dropped_tags = 1200;
  metrics.refresh(status, counters);
  text = MetricsText(metrics.text());
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"instrument\"}"), 5);
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"ring\"}"), 1200);
  EXPECT_EQ(text("splid_ring_fill_ratio"), 0);
}

TEST_F(MetricsTest, AreDueOnceASecond) {
  Metrics metrics = make();
  EXPECT_TRUE(metrics.due());
  metrics.refresh({}, {});
  clock.advance_ms(999);
  EXPECT_FALSE(metrics.due());
  clock.advance_ms(1);
  EXPECT_TRUE(metrics.due());
}

TEST_F(MetricsTest, SayTheSameAsTheStreamsSummary) {
  Metrics metrics = make();
  Publisher publisher(config.publish.endpoint, 1000);
  test::MeasuredStream measured(config, open_scene(config), publisher, host_clock(), &metrics);
  const StreamSummary summary = measured.run({});
  ASSERT_GE(summary.frames, 10U);
  const MetricsText text(metrics.text());
  const auto number = [](std::uint64_t count) { return static_cast<double>(count); };
  EXPECT_EQ(text.sum("splid_frames_total"), number(summary.frames));
  EXPECT_EQ(text("splid_frames_total{status=\"ok\"}"),
            number(summary.frames_by_status[static_cast<std::size_t>(FrameStatus::ok)]));
  EXPECT_EQ(text("splid_frame_latency_seconds_count"), number(summary.frames));
  EXPECT_EQ(text("splid_tags_read_total"), number(summary.tags.events));
  EXPECT_EQ(text("splid_tags_total{channel=\"photon\"}"), number(summary.tags.photons));
  EXPECT_EQ(text("splid_tags_total{channel=\"sync\"}"), number(summary.tags.syncs));
  EXPECT_EQ(text("splid_tags_read_total"), text.sum("splid_tags_total") -
                                               text("splid_tags_shared_total") +
                                               text("splid_tags_lost_total{cause=\"late\"}") +
                                               text("splid_tags_lost_total{cause=\"surplus\"}"));
  EXPECT_EQ(text.sum("splid_tags_lost_total"), number(summary.lost_tags + summary.discarded_tags));
  EXPECT_GT(text("splid_ring_fill_ratio"), 0);
  EXPECT_NEAR(text("splid_sync_drift_ratio"), 2e-6, 1e-6);
  EXPECT_EQ(text("splid_state{state=\"stopping\"}"), 1);
}

// A live source that sends more than the ring holds, at once, and then waits to be stopped.
class FloodSource final : public TagSource {
 public:
  explicit FloodSource(std::int64_t syncs) : syncs_(syncs) {}
  [[nodiscard]] SourceInfo info() const override { return {"flood", true, {}}; }
  void run(TagSink& sink, std::stop_token) override {
    // As a driver says that its instrument lost 7 tags.
    put(sink, {0, 0, TagKind::loss_begin, {}});
    put(sink, {1, 7, TagKind::loss_end, {}});
    for (std::int64_t i = 1; i <= syncs_; ++i) put(sink, sync_tag(i * 3'780'000));
  }

 private:
  static void put(TagSink& sink, const Tag& tag) {
    sink.claim(1).front() = tag;
    sink.publish(1);
  }
  std::int64_t syncs_;
};

TEST_F(MetricsTest, TellTheRingsLossesFromTheInstruments) {
  constexpr std::int64_t syncs = 3'000'000;
  config.pipeline.ring_capacity_tags = 1 << 14;
  config.frame.length_ms = 10;
  Metrics metrics = make();
  Publisher publisher(config.publish.endpoint, 1000);
  test::MeasuredStream measured(config, std::make_unique<FloodSource>(syncs), publisher,
                                host_clock(), &metrics);
  // Frames cannot leave, so that the ring has to fill.
  measured.observe([](const FrameMessage& frame, const std::string&) {
    if (frame.sequence < 3) std::this_thread::sleep_for(std::chrono::milliseconds{100});
    return true;
  });
  const StreamSummary summary = measured.run({});
  const MetricsText text(metrics.text());
  const double dropped = text("splid_tags_lost_total{cause=\"ring\"}");
  EXPECT_GT(dropped, 0);
  EXPECT_EQ(text("splid_tags_lost_total{cause=\"instrument\"}"), 7);
  EXPECT_EQ(text.sum("splid_tags_lost_total"),
            static_cast<double>(summary.lost_tags + summary.discarded_tags));
  EXPECT_EQ(text("splid_tags_read_total") + dropped, static_cast<double>(syncs));
}

TEST_F(MetricsTest, TheFileIsWholeReadableAndHasNoTwin) {
  config.metrics.file = folder.write("splid.prom", "from before");
  const mode_t usual = umask(0077);
  Metrics metrics = make();
  metrics.refresh({}, {});
  umask(usual);
  EXPECT_EQ(file_text(config.metrics.file), metrics.text());
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(config.metrics.file).permissions(),
            perms::owner_read | perms::owner_write | perms::group_read | perms::others_read);
  EXPECT_FALSE(std::filesystem::exists(config.metrics.file + ".tmp"));
  EXPECT_THAT(notices, testing::IsEmpty());
}

TEST_F(MetricsTest, AFileThatCannotBeWrittenIsSaidOnceAndComesBack) {
  config.metrics.file = folder.path("later/splid.prom");
  Metrics metrics = make();
  for (int second = 0; second < 3; ++second) metrics.refresh({}, {});
  EXPECT_THAT(notices, ElementsAre(AllOf(HasSubstr("metrics.file " + config.metrics.file),
                                         HasSubstr("No such file or directory"))));
  std::filesystem::create_directory(folder.path("later"));
  for (int second = 0; second < 3; ++second) metrics.refresh({}, {});
  EXPECT_THAT(notices, ElementsAre(testing::_, HasSubstr("is written again")));
  EXPECT_EQ(file_text(config.metrics.file), metrics.text());
}

// A disk that is full after 100 bytes, as this process sees it.
class FullDisk {
 public:
  FullDisk() {
    getrlimit(RLIMIT_FSIZE, &usual_);
    const rlimit little{100, usual_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &little);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &usual_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit usual_{};
  void (*handler_)(int) = std::signal(SIGXFSZ, SIG_IGN);
};

TEST_F(MetricsTest, AFullDiskLeavesTheFileAsItWas) {
  config.metrics.file = folder.write("splid.prom", "from before");
  Metrics metrics = make();
  {
    const FullDisk full;
    metrics.refresh({}, {});
  }
  EXPECT_THAT(notices, ElementsAre(HasSubstr("File too large")));
  EXPECT_EQ(file_text(config.metrics.file), "from before");
  EXPECT_FALSE(std::filesystem::exists(config.metrics.file + ".tmp"));
}

TEST_F(MetricsTest, APortInUseIsAnErrorWithItsPlace) {
  config.metrics.http = "127.0.0.1:*";
  const Metrics first = make();
  ASSERT_THAT(first.url(), testing::MatchesRegex("http://127.0.0.1:[0-9]+/metrics"));
  const std::string rest = first.url().substr(7);
  config.metrics.http = rest.substr(0, rest.find('/'));
  EXPECT_THAT(
      test::error_text([&] { (void)make(); }),
      AllOf(HasSubstr("metrics.http " + config.metrics.http), HasSubstr("another program")));
}

}  // namespace
}  // namespace splid
