#include "config/former_values.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Config with_effort(const std::string& effort) {
  const test::TempFolder folder;
  const std::string text =
      R"({"schema":"splid.config","source":{"driver":"simulator"},"pattern":{"file":")" SPLID_SOURCE_DIR
      R"(/config/patterns/interleaved-180-189.json"},"estimator":{"effort":")" +
      effort + "\"}}";
  return load_config(folder.write("c.json", text));
}

TEST(FormerValues, AnEffortThatIsNoMoreIsTakenForAnotherAndSaid) {
  const Config config = with_effort("exhaustive");
  EXPECT_EQ(config.estimator.effort, Effort::balanced);
  EXPECT_THAT(config.notes,
              ElementsAre(config.file + ": /estimator/effort: \"exhaustive\" is no longer there, "
                                        "since it took twice the time to find less than one "
                                        "target in a hundred more; "
                                        "\"balanced\" is taken for it"));
  EXPECT_EQ(config_to_json(config).find("exhaustive"), std::string::npos);
}

TEST(FormerValues, OthersAreLeftAlone) {
  EXPECT_THAT(with_effort("fast").notes, IsEmpty());
  EXPECT_EQ(with_effort("fast").estimator.effort, Effort::fast);
  for (const char* text :
       {"[]", "7", R"({"estimator":3})", R"({"estimator":{"effort":["exhaustive"]}})",
        R"({"effort":"exhaustive"})"}) {
    nlohmann::json document = nlohmann::json::parse(text);
    const nlohmann::json before = document;
    EXPECT_THAT(replace_former_values(document, "c.json"), IsEmpty()) << text;
    EXPECT_EQ(document, before);
  }
}

}  // namespace
}  // namespace splid
