#include "daemon/service/reload.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/daemon_scene.hpp"

namespace splid {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ConfigChanges, AreNoneBetweenTheSame) {
  const ConfigChanges changes = changes_between(scene_config(1), scene_config(1), scene_config(1));
  EXPECT_THAT(changes.live, IsEmpty());
  EXPECT_THAT(changes.restart, IsEmpty());
}

TEST(ConfigChanges, TellWhatTakesARestart) {
  Config after = scene_config(2);
  after.scene.max_speed_mps = 15;
  after.estimator.tracked = true;
  after.detector.dead_time_ns = 40;
  after.detector.walk = {{50, 150}};
  after.frame.min_seen_fraction = 0.5;
  after.frame.length_ms = 20;
  after.publish.endpoint = "ipc:///run/splid/frames";
  after.security.allow_list = "others";
  after.pattern.segments.front().pulse_times_ps[1] += 1;
  Config before = scene_config(1);
  before.security.allow_list = "readers";
  const ConfigChanges changes = changes_between(before, after, before);
  EXPECT_THAT(changes.live, ElementsAre("/detector/dead_time_ns", "/estimator/tracked",
                                        "/frame/min_seen_fraction", "/scene/max_speed_mps",
                                        "/security/allow_list"));
  EXPECT_THAT(changes.restart, ElementsAre("/detector/walk/-", "/frame/length_ms", "/pattern",
                                           "/publish/endpoint", "/source/seconds"));
}

// A list that nobody asks, or that nobody would ask any more, changes nothing until a restart.
TEST(ConfigChanges, AnAllowListThatComesOrGoesTakesARestart) {
  const auto with_lists = [](const std::string& readers, const std::string& operators) {
    Config config = scene_config(1);
    config.security.allow_list = readers;
    config.control.allow_list = operators;
    return config;
  };
  const Config open = with_lists("", "");
  const Config closed = with_lists("readers", "operators");
  const Config other = with_lists("others", "operators");
  const auto both = ElementsAre("/control/allow_list", "/security/allow_list");
  EXPECT_THAT(changes_between(open, closed, open).restart, both);
  EXPECT_THAT(changes_between(closed, open, closed).restart, both);
  // The file has had one since; the daemon was started without.
  EXPECT_THAT(changes_between(closed, other, open).restart, ElementsAre("/security/allow_list"));
  EXPECT_THAT(changes_between(closed, other, closed).live, ElementsAre("/security/allow_list"));
}

TEST(WithLive, IsTheStartedConfigurationButForWhatIsLive) {
  const Config started = scene_config(1);
  Config next = scene_config(2);
  next.scene.max_speed_mps = 15;
  next.estimator.tracked = true;
  next.pulse.sigma_ps = 70;
  next.detector.dead_time_ns = 40;
  next.frame.min_seen_fraction = 0.5;
  Config live = with_live(started, next);
  EXPECT_THAT(changes_between(live, next, started).live, IsEmpty());
  next.detector.walk = {{50, 150}};
  next.frame.length_ms = 20;
  next.pixels.resize(3);
  next.pattern.segments.front().pulse_times_ps[1] += 1;
  live = with_live(started, next);
  EXPECT_THAT(changes_between(started, live, started).restart, IsEmpty());
  EXPECT_THAT(changes_between(started, live, started).live,
              ElementsAre("/detector/dead_time_ns", "/estimator/tracked",
                          "/frame/min_seen_fraction", "/pulse/sigma_ps", "/scene/max_speed_mps"));
}

}  // namespace
}  // namespace splid
