#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <string>
#include <vector>

#include "tests/support/process_memory.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/watched_daemon.hpp"

// The built program with more to do than its processor can: a live scene without a target, whose
// search takes the longer the more a path may curve. How much is chosen by the time that frames
// take here, and taken back by a reload.

#ifndef SPLID_SANITIZED  // every frame takes too long there

namespace splid {
namespace {

using test::WatchedDaemon;

constexpr double usual_mps = 150;

class Overload : public ::testing::Test {
 protected:
  // max_acceleration_mps2: of a path that may curve; 0: it may not.
  std::string config(const char* effort, double max_speed_mps,
                     double max_acceleration_mps2 = 0) const {
    return folder.write(
        "config.json",
        R"({"schema":"splid.config","control":{"endpoint":"off"},"source":{"driver":"simulator","signal_per_pulse":0,"ambient_per_s":)" +
            std::to_string(ambient_per_s) +
            R"(},)"
            R"("pipeline":{"ring_capacity_tags":)" +
            std::to_string(ring_capacity_tags) + R"(},"estimator":{"effort":")" +
            std::string(effort) + R"("},"scene":{"max_speed_mps":)" +
            std::to_string(max_speed_mps) +
            (max_acceleration_mps2 > 0 ? R"(,"motion":"accelerating","max_acceleration_mps2":)" +
                                             std::to_string(max_acceleration_mps2)
                                       : "") +
            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
            R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":")" +
            endpoint + "\"}}");
  }
  void start(const char* effort) {
    daemon = std::make_unique<WatchedDaemon>(config(effort, usual_mps), endpoint);
    ASSERT_TRUE(daemon->await_frame(is_measured));
  }
  void reload(const char* effort, double max_speed_mps, double max_acceleration_mps2 = 0) const {
    config(effort, max_speed_mps, max_acceleration_mps2);
    daemon->program->signal(SIGHUP);
  }
  static bool is_measured(const FrameMessage& frame) {
    return frame.status == FrameStatus::no_target && frame.seen_fraction.value_or(0) == 1;
  }
  void TearDown() override {
    const test::ProgramResult result = daemon->stop();
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  int ring_capacity_tags = 1 << 20;  // two seconds
  int ambient_per_s = 175'000;
  test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("frames");
  std::unique_ptr<WatchedDaemon> daemon;
};

TEST_F(Overload, EffortIsLoweredBeforeAFrameIsDroppedAndComesBack) {
  start("balanced");
  daemon->start_counting();
  auto begin = WatchedDaemon::Clock::now();
  const auto is_lowered = [](const FrameMessage& frame) {
    return frame.effort.value_or("balanced") != "balanced";
  };
  // Curvature costs more than any speed: a frame of 50 ms takes 17 ms of a fast core with 100
  // m/s^2, and 400 ms with 10,000.
  bool lowered = false;
  for (double mps2 = 100; !lowered && mps2 < 9e4; mps2 *= 2) {
    begin = WatchedDaemon::Clock::now();
    reload("balanced", usual_mps, mps2);
    for (int i = 0; i < 20 && !lowered; ++i) {
      ASSERT_TRUE(daemon->await_frame(is_measured));
      lowered = is_lowered(*daemon->last_frame);
    }
  }
  ASSERT_TRUE(daemon->await_status("its effort is lowered to"));
  const double said_ms = WatchedDaemon::ms_since(begin);
  const std::string said = daemon->said;
  begin = WatchedDaemon::Clock::now();
  reload("balanced", usual_mps);
  for (int in_a_row = 0; in_a_row < 5; ++in_a_row) {
    ASSERT_TRUE(daemon->await_frame(is_measured));
    if (is_lowered(*daemon->last_frame)) in_a_row = -1;
  }
  EXPECT_EQ(daemon->lost_tags, 0U);
  test::record({"estimation takes longer than frames do; then less (5 frames as configured)", said,
                said_ms, daemon->losses(), WatchedDaemon::ms_since(begin)});
}

// Even at the least effort: then the ring fills, and what does not fit is a loss of its frame.
TEST_F(Overload, WhatTheRingCannotHoldIsACountedLoss) {
  // The ring holds two frames. A slow machine keeps up with this light once the acceleration ends.
  ring_capacity_tags = 1 << 17;
  ambient_per_s = 1'250'000;
  start("fast");
  daemon->start_counting();
  auto begin = WatchedDaemon::Clock::now();
  bool is_lost = false;
  for (double mps2 = 100; !is_lost && mps2 < 9e4; mps2 *= 2) {
    begin = WatchedDaemon::Clock::now();
    reload("fast", usual_mps, mps2);
    for (int i = 0; i < 30 && !is_lost; ++i) {
      ASSERT_TRUE(daemon->await_frame([](const FrameMessage&) { return true; }));
      is_lost = daemon->last_frame->lost_tags.value_or(0) > 1000;
    }
  }
  ASSERT_TRUE(is_lost);
  const double said_ms = WatchedDaemon::ms_since(begin);
  const std::string shown = "a frame: " + std::string(to_string(daemon->last_frame->status));
  begin = WatchedDaemon::Clock::now();
  reload("fast", usual_mps);
  double good_ms = 0;
  for (int in_a_row = 0; in_a_row < 20; ++in_a_row) {
    ASSERT_TRUE(daemon->await_frame([](const FrameMessage&) { return true; }));
    if (!is_measured(*daemon->last_frame)) in_a_row = -1;
    if (in_a_row == 0) good_ms = WatchedDaemon::ms_since(begin);
  }
  test::record({"estimation takes longer than frames do at the least effort: the ring is full",
                shown, said_ms, daemon->losses(), good_ms});
}

// Less address space than the ring and the frames take.
TEST(MemoryLimit, AtTheStartIsSaidInASentence) {
  const test::TempFolder folder;
  const std::string config = folder.write(
      "config.json",
      R"({"schema":"splid.config","control":{"endpoint":"off"},"source":{"driver":"simulator"},"pattern":{"file":")" SPLID_SOURCE_DIR
      R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":"ipc://)" +
          folder.path("frames") + R"("},"pipeline":{"ring_capacity_tags":16777216}})");
  test::Program limited(
      {"-c", "ulimit -v 300000; exec \"$0\" run --config \"$1\"", SPLID_BINARY, config}, "/bin/sh");
  const test::ProgramResult result = limited.wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, testing::HasSubstr("not enough memory"));
  EXPECT_THAT(result.err, testing::HasSubstr("/pipeline/ring_capacity_tags"));
  test::record({"300 MB of memory allowed where 770 are needed, at the start",
                "exit code 3: not enough memory: lower /pipeline/ring_capacity_tags or ...", -1, "",
                -1});
}

TEST_F(Overload, WithoutMemoryForAReloadItGoesOnAsBefore) {
  start("fast");
  daemon->start_counting();
  const pid_t process = daemon->program->id();
  // Some for the messages, too little for an estimator.
  const double allowed_mib = test::memory_mib("VmSize", std::to_string(process)) + 4;
  const rlimit little{static_cast<rlim_t>(allowed_mib * 1024 * 1024), RLIM_INFINITY};
  ASSERT_EQ(prlimit(process, RLIMIT_AS, &little, nullptr), 0);
  const auto begin = WatchedDaemon::Clock::now();
  reload("balanced", usual_mps);
  ASSERT_TRUE(daemon->await_status("not reloaded"));
  const double said_ms = WatchedDaemon::ms_since(begin);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(daemon->await_frame(is_measured));
  EXPECT_EQ(daemon->last_frame->effort.value_or(""), "fast");
  const rlimit all{RLIM_INFINITY, RLIM_INFINITY};
  ASSERT_EQ(prlimit(process, RLIMIT_AS, &all, nullptr), 0);
  EXPECT_EQ(daemon->lost_tags, 0U);
  test::record({"memory limit of 4 MiB more than it has, SIGHUP", daemon->said, said_ms,
                daemon->losses(), 0});
}

}  // namespace
}  // namespace splid

#endif
