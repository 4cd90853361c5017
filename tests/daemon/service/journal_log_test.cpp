#include "daemon/service/journal_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/details/log_msg.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string formatted(spdlog::level::level_enum level, const std::string& text) {
  const spdlog::details::log_msg message("splid", level, text);
  spdlog::memory_buf_t out;
  journal_formatter()->clone()->format(message, out);
  return {out.data(), out.size()};
}

TEST(JournalLog, EachLevelHasItsPriority) {
  const std::vector<std::pair<spdlog::level::level_enum, std::string>> all = {
      {spdlog::level::debug, "<7>debug: x\n"},
      {spdlog::level::info, "<6>info: x\n"},
      {spdlog::level::warn, "<4>warning: x\n"},
      {spdlog::level::err, "<3>error: x\n"},
      {spdlog::level::critical, "<2>critical: x\n"}};
  for (const auto& [level, line] : all) EXPECT_EQ(formatted(level, "x"), line);
}

// The journal takes each line by itself.
TEST(JournalLog, EachLineHasAPriority) {
  EXPECT_EQ(formatted(spdlog::level::warn, "one\ntwo"), "<4>warning: one\n<4>two\n");
  EXPECT_EQ(error_lines("one\ntwo\n", true), "<3>one\n<3>two\n");
  EXPECT_EQ(error_lines("one\ntwo\n", false), "one\ntwo\n");
}

class JournalProgram : public ::testing::Test {
 protected:
  // What the program says on standard error while JOURNAL_STREAM names `stream`.
  std::string said(const std::string& stream, const std::string& arguments) {
    const std::string file = folder.path("err");
    const std::string script =
        "exec 2>" + file + "; JOURNAL_STREAM=" + stream + " exec " + SPLID_BINARY + " " + arguments;
    test::Program({"-c", script}, "/bin/sh").wait();
    return test::file_text(file);
  }

  test::TempFolder folder;
};

TEST_F(JournalProgram, PrioritiesAreForTheJournalAlone) {
  const std::string own = "$(stat -L -c %d:%i " + folder.path("err") + ")";
  for (const char* wrong : {"run --config /nowhere/c.json", "run", "no-command"}) {
    EXPECT_THAT(said(own, wrong), StartsWith("<3>")) << wrong;
    // Another's, such as that of a shell in a service, whose output goes elsewhere.
    EXPECT_THAT(said("1:2", wrong), ::testing::Not(HasSubstr("<3>"))) << wrong;
  }
}

TEST_F(JournalProgram, InformationIsInformation) {
  const std::string own = "$(stat -L -c %d:%i " + folder.path("err") + ")";
  const std::string golden = SPLID_SOURCE_DIR "/tests/data/golden/interleaved";
  const std::string text = said(own, "replay " + golden + ".ptu --config " + golden + ".json");
  EXPECT_THAT(text, HasSubstr("<6>info: source "));
}

}  // namespace
}  // namespace splid
