#include "daemon/service/memory.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/process_memory.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/watched_daemon.hpp"

namespace splid {
namespace {

#ifndef SPLID_SANITIZED

// What `splid check` and docs/reference/configuration.md say against what the built program has.
TEST(MemoryNeeded, IsWhatTheProgramHas) {
  struct Setting {
    std::string keys;
    int frames = 20;  // that are waited for
    std::string pattern = "interleaved-180-189";
    std::string scene = {};  // beside the driver
  };
  const std::vector<Setting> settings = {
      {R"("pipeline":{"ring_capacity_tags":131072},"frame":{"length_ms":10})"},
      {R"("pipeline":{"ring_capacity_tags":524288},"scene":{"motion":"static"})"},
      {R"("pipeline":{"ring_capacity_tags":524288,"estimation_threads":4})"},
      {R"("pipeline":{"ring_capacity_tags":4194304})"},
      {R"("pipeline":{"ring_capacity_tags":524288},"scene":{"targets":2})"},
      // The tables are those of frames of 10 s with 150 m/s.
      {R"("pipeline":{"ring_capacity_tags":524288},"scene":{"max_speed_mps":30000})", 1},
      {R"("pipeline":{"ring_capacity_tags":524288},"scene":{"max_speed_mps":30000})", 1,
       "random-40"},
      {R"("pipeline":{"ring_capacity_tags":2097152},"frame":{"by":"line:1:2:8","length_ms":5})", 20,
       "interleaved-180-189",
       R"(,"array":{"columns":8,"rows":2,"planes":[{"motion":"linear","distance_m":20,)"
       R"("signal_per_pulse":0.02}]},"scanner":{"dwell_ms":5})"}};
  for (const auto& [setting, frames, pattern, scene] : settings) {
    const test::TempFolder folder;
    const std::string endpoint = "ipc://" + folder.path("frames");
    const std::string file = folder.write(
        "config.json", R"({"schema":"splid.config","source":{"driver":"simulator")" + scene +
                           R"(},"pattern":{"file":")" SPLID_SOURCE_DIR "/config/patterns/" +
                           pattern + R"(.json"},"control":{"endpoint":"off"},)" + setting +
                           R"(,"publish":{"endpoint":")" + endpoint + "\"}}");
    const double needed_mib = memory_needed_mib(load_config(file));
    test::WatchedDaemon daemon(file, endpoint);
    for (int i = 0; i < frames; ++i) ASSERT_TRUE(daemon.await_good_frame());
    const double has_mib = test::memory_mib("VmRSS", std::to_string(daemon.program->id()));
    EXPECT_NEAR(needed_mib / has_mib, 1, 0.15) << setting << ": " << has_mib << " MiB";
    std::printf("%s: %.1f MiB, by the formula %.1f\n", setting.c_str(), has_mib, needed_mib);
    EXPECT_EQ(daemon.stop().exit_code, 0);
  }
}

// Sixteen pixels of four kinds, of which one counts.
TEST(MemoryNeeded, IsWhatTheProgramHasForSeveralPixels) {
  const test::TempFolder folder;
  const std::string endpoint = "ipc://" + folder.path("frames");
  std::string pixels;
  for (int input = 1; input <= 16; ++input) {
    pixels += (pixels.empty() ? "" : ",") + std::string(R"({"input":)") + std::to_string(input) +
              R"(,"sigma_ps":)" + std::to_string(100 + input % 4) + "}";
  }
  const std::string file = folder.write(
      "config.json",
      R"({"schema":"splid.config","source":{"driver":"simulator"},"pattern":{"file":")" SPLID_SOURCE_DIR
      R"(/config/patterns/interleaved-180-189.json"},"control":{"endpoint":"off"},"pixels":[)" +
          pixels + R"(],"pipeline":{"ring_capacity_tags":1048576,"estimation_threads":2},)" +
          R"("publish":{"endpoint":")" + endpoint + "\"}}");
  const double needed_mib = memory_needed_mib(load_config(file));
  test::WatchedDaemon daemon(file, endpoint);
  ASSERT_TRUE(daemon.await_status("count nothing"));
  const double has_mib = test::memory_mib("VmRSS", std::to_string(daemon.program->id()));
  EXPECT_NEAR(needed_mib / has_mib, 1, 0.15) << has_mib << " MiB";
  EXPECT_EQ(daemon.stop().exit_code, 0);
}

#endif

}  // namespace
}  // namespace splid
