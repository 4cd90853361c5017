#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "tests/support/fault_record.hpp"
#include "tests/support/program.hpp"
#include "tests/support/watched_daemon.hpp"

namespace splid::test {

constexpr double m_per_ps = 299'792'458e-12 / 2;  // of the distance, as light goes there and back

// What goes wrong with an instrument, or in its maker's library, while frames come.
template <class Instrument>
struct BridgedFault {
  const char* name;
  const char* words;  // what it is, for the table
  std::function<void(Instrument&)> inject;
  const char* said;                         // words of the daemon's status; empty: a frame shows it
  std::function<void(Instrument&)> heal{};  // empty: it is over by itself
  bool ends_bridge = false;                 // and the service manager starts another
  bool costs_frames = false;                // good frames are those after one that is hurt
};

template <class Instrument>
void PrintTo(const BridgedFault<Instrument>& fault, std::ostream* out) {
  *out << fault.name;
}

// Injects a fault while good frames come, and waits until they come again. Bridging: a BridgedRun
// with `instrument` and write_scene_config(). distance_m: of the scene. start_bridge: starts one.
template <class Bridging, class Fault>
void expect_told_and_mended(Bridging& bridging, const Fault& fault, double distance_m,
                            const std::function<std::unique_ptr<Program>()>& start_bridge) {
  auto bridge = start_bridge();
  WatchedDaemon daemon(bridging.write_scene_config(), "tcp://127.0.0.1:*");
  ASSERT_TRUE(daemon.await_good_frame()) << bridge->err();
  daemon.start_counting();
  auto begin = WatchedDaemon::Clock::now();
  fault.inject(bridging.instrument);
  const bool is_said = *fault.said != '\0';
  if (is_said) {
    ASSERT_TRUE(daemon.await_status(fault.said)) << bridge->err();
  }
  const double said_ms = WatchedDaemon::ms_since(begin);
  if (fault.heal) {
    begin = WatchedDaemon::Clock::now();
    fault.heal(bridging.instrument);
  }
  if (fault.ends_bridge) {
    EXPECT_NE(bridge->wait().exit_code, 0);
    bridge = start_bridge();
  }
  if (fault.costs_frames && daemon.hurt_frames == 0) {
    ASSERT_TRUE(daemon.await_frame(WatchedDaemon::is_hurt)) << bridge->err();
  }
  ASSERT_TRUE(daemon.await_good_frame()) << bridge->err();
  EXPECT_NEAR(daemon.last_frame->distance_m.value_or(0), distance_m, 0.1);
  record({fault.words, is_said ? daemon.said : "nothing: no tag is lost", is_said ? said_ms : -1,
          daemon.losses(), WatchedDaemon::ms_since(begin)});
  EXPECT_EQ(daemon.stop().exit_code, 0);
}

}  // namespace splid::test
