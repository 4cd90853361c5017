#include "config/path_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "drivers/replay/replay.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "tests/support/temp_folder.hpp"

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

TEST(WrittenFiles, AreNoneThatAreRead) {
  const test::TempFolder folder;
  Config config;
  config.file = folder.write("c.json", "{}");
  config.source_driver = "simulator";
  config.source = std::make_unique<simulator::Options>();
  config.pattern_file = folder.write("p.json", "{}");
  EXPECT_FALSE(written_file_fault(config));
  config.metrics.file = folder.path("m.prom");  // not there
  EXPECT_FALSE(written_file_fault(config));
  config.metrics.file = folder.path("./p.json");
  const auto fault = written_file_fault(config);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->pointer, "/metrics/file");
  EXPECT_THAT(fault->what, ::testing::HasSubstr("is what is read as /pattern/file"));
  std::filesystem::create_symlink(config.file, folder.path("link"));
  config.metrics.file = folder.path("link");
  EXPECT_THAT(written_file_fault(config)->what, ::testing::HasSubstr("the configuration itself"));
}

}  // namespace
}  // namespace splid
