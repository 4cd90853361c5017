#include "daemon/service/reload.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/daemon_scene.hpp"

namespace splid {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ConfigChanges, AreNoneBetweenTheSame) {
  const ConfigChanges changes = changes_between(scene_config(1), scene_config(1));
  EXPECT_THAT(changes.live, IsEmpty());
  EXPECT_THAT(changes.restart, IsEmpty());
}

TEST(ConfigChanges, TellWhatTakesARestart) {
  Config after = scene_config(2);
  after.scene.max_speed_mps = 15;
  after.estimator.tracked = true;
  after.detector.dead_time_ns = 40;
  after.frame.min_seen_fraction = 0.5;
  after.frame.length_ms = 20;
  after.publish.endpoint = "ipc:///run/splid/frames";
  after.security.allow_list = "others";
  after.pattern.segments.front().pulse_times_ps[1] += 1;
  const ConfigChanges changes = changes_between(scene_config(1), after);
  EXPECT_THAT(changes.live, ElementsAre("/detector/dead_time_ns", "/estimator/tracked",
                                        "/frame/min_seen_fraction", "/scene/max_speed_mps",
                                        "/security/allow_list"));
  EXPECT_THAT(changes.restart,
              ElementsAre("/frame/length_ms", "/pattern", "/publish/endpoint", "/source/seconds"));
}

}  // namespace
}  // namespace splid
