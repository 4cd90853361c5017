#include "config/path_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/replay/replay.hpp"
#include "drivers/simulator/simulator_options.hpp"

namespace splid {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> listed(const Config& config) {
  std::vector<std::string> lines;
  for (const NamedPath& input : input_files(config)) {
    lines.push_back(input.pointer + " " + input.path);
  }
  return lines;
}

TEST(InputFiles, AreAllThatAConfigurationNamesToBeRead) {
  Config config;
  config.file = "c.json";
  config.source_driver = "replay";
  auto source = std::make_unique<ReplayOptions>();
  source->recording = "a.ptu";
  config.source = std::move(source);
  config.pattern_file = "p.json";
  config.encoder.file = "counts.csv";
  config.security.server_key = "k";
  config.metrics.file = "m.prom";
  config.record.folder = "kept";
  EXPECT_THAT(listed(config), ElementsAre("the configuration itself c.json",
                                          "/source/recording a.ptu", "/encoder/file counts.csv",
                                          "/pattern/file p.json", "/security/server_key k"));
}

TEST(InputFiles, OfASceneAreNotItsTruth) {
  Config config;
  config.file = "c.json";
  config.source_driver = "simulator";
  auto scene = std::make_unique<simulator::Options>();
  scene->truth = "t.json";
  config.source = std::move(scene);
  EXPECT_THAT(listed(config), ElementsAre("the configuration itself c.json"));
}

}  // namespace
}  // namespace splid
