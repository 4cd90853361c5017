#include "config/path_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

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

// A source that has a list of three parts, each with a file, and notes which of them it is asked
// of.
class ListedSource final : public SourceOptions {
 public:
  explicit ListedSource(std::vector<std::size_t>& asked) : asked_(asked) {}
  void describe(OptionVisitor& visitor) override {
    visitor.objects(
        "parts", [](std::size_t) {},
        [this](OptionVisitor& part, std::size_t i) {
          asked_.push_back(i);
          std::string file = "part-" + std::to_string(i);
          part.path("file", file, "");
        },
        3, "");
  }
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext&) const override { return {}; }

 private:
  std::vector<std::size_t>& asked_;
};

TEST(InputFiles, OfAListAreThoseOfItsMembersAndNoneBeyond) {
  std::vector<std::size_t> asked;
  Config config;
  config.file = "c.json";
  config.source_driver = "replay";  // a name that is registered
  config.source = std::make_unique<ListedSource>(asked);
  EXPECT_THAT(listed(config),
              ElementsAre("the configuration itself c.json", "/source/parts/0/file part-0",
                          "/source/parts/1/file part-1", "/source/parts/2/file part-2"));
  EXPECT_THAT(asked, ElementsAre(0, 1, 2));
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
