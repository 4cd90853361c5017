#include "config/pattern_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "config/config.hpp"
#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PatternFiles : public ::testing::Test {
 protected:
  PatternFile find(const std::string& written) const {
    return find_pattern_file(folder.path(written), written, shipped, "c.json: /pattern/file: ");
  }

  test::TempFolder folder;
  std::string shipped = SPLID_SOURCE_DIR "/config/patterns";
};

TEST_F(PatternFiles, AreBesideTheFileThatNamesThem) {
  const std::string file = folder.write("patterns/random-40.json", "mine");
  const PatternFile found = find("patterns/random-40.json");
  EXPECT_EQ(found.path, file);
  EXPECT_THAT(found.note, IsEmpty());
}

TEST_F(PatternFiles, OfTheInstallationAreTakenWhereNoneIsThereAndItIsSaid) {
  for (const char* written : {"patterns/random-40.json", "random-40.json", "../x/random-40.json"}) {
    const PatternFile found = find(written);
    EXPECT_EQ(found.path, shipped + "/random-40.json");
    EXPECT_THAT(found.note, AllOf(HasSubstr("c.json: /pattern/file: "), HasSubstr("does not exist"),
                                  HasSubstr(found.path)));
  }
}

TEST_F(PatternFiles, OfAnotherNameAreAnErrorThatNamesThoseThereAre) {
  EXPECT_THAT(test::error_text([&] { (void)find("patterns/random-41.json"); }),
              AllOf(HasSubstr("c.json: /pattern/file: " + folder.path("patterns/random-41.json")),
                    HasSubstr("random-40.json"), HasSubstr("interleaved-180-189.json")));
}

// Whoever writes a whole path means that file.
TEST_F(PatternFiles, OfAWholePathAreThatFileAlone) {
  const std::string whole = folder.path("random-40.json");
  EXPECT_EQ(find_pattern_file(whole, whole, shipped, "").path, whole);
  EXPECT_EQ(find_pattern_file("a/random-40.json", "random-40.json", "", "").path,
            "a/random-40.json");
}

TEST_F(PatternFiles, ACopiedExampleFindsItsPatternInTheRepository) {
  std::filesystem::copy(SPLID_SOURCE_DIR "/config/replay.json", folder.path("my.json"));
  EXPECT_TRUE(std::filesystem::equivalent(shipped_patterns_folder(), shipped));
  const Config config = load_config(folder.path("my.json"));
  EXPECT_EQ(std::filesystem::path(config.pattern_file).filename(), "interleaved-180-189.json");
  EXPECT_THAT(config.notes,
              testing::ElementsAre(HasSubstr("taken instead is splid's own pattern")));
}

}  // namespace
}  // namespace splid
