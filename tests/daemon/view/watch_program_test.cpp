#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/support/light_scene.hpp"
#include "tests/support/matches.hpp"
#include "tests/support/program.hpp"
#include "tests/support/terminal_program.hpp"

// `splid listen --watch` in a terminal, and where there is none.

namespace splid::view {
namespace {

using test::Program;
using test::TerminalProgram;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

std::size_t characters(const std::string& line) {
  std::size_t count = 0;
  for (const char byte : line) {
    if ((static_cast<unsigned char>(byte) & 0xC0U) != 0x80U) ++count;
  }
  return count;
}

// The lines of the last picture that was written whole, without the codes of the terminal.
std::vector<std::string> picture(const std::string& written) {
  const std::string home = "\033[H";
  const auto end = written.rfind(home);
  if (end == std::string::npos || end == 0) return {};
  const auto begin = written.rfind(home, end - 1);
  if (begin == std::string::npos) return {};
  const std::string text = written.substr(begin, end - begin);
  std::istringstream in(test::without_matches(text, "\033\\[[0-9;?]*[A-Za-z]|\r"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

bool shows(const std::vector<std::string>& lines, const std::string& what) {
  for (const std::string& line : lines) {
    if (line.find(what) != std::string::npos) return true;
  }
  return false;
}

// On a machine that is slow the effort is lowered.
bool measures(const std::vector<std::string>& lines) {
  return shows(lines, "ok  ") || shows(lines, "ok, degraded");
}

bool fits(const std::vector<std::string>& lines, std::size_t columns, std::size_t rows) {
  if (lines.empty() || lines.size() > rows) return false;
  for (const std::string& line : lines) {
    if (characters(line) > columns) return false;
  }
  return true;
}

class Watch : public ::testing::Test {
 protected:
  std::vector<std::string> watch() const { return {"listen", "--watch", "--endpoint", endpoint}; }

  // source: its members in JSON.
  std::string config_with(const std::string& source) const {
    return folder.write("live.json", R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
                                         R"(},)"
                                         R"("pattern":{"file":")" SPLID_SOURCE_DIR
                                         R"(/config/patterns/interleaved-180-189.json"},)"
                                         R"("publish":{"endpoint":")" +
                                         endpoint + "\"}" +
                                         test::with_light_scene(test::small_ring) + "}");
  }

  test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("socket");
  std::string config = config_with(std::string(test::light_source));
};

TEST_F(Watch, FillsTheTerminalFollowsItsSizeAndGivesItBack) {
  Program daemon({"run", "--config", config});
  TerminalProgram watcher(watch(), 80, 24, {"TERM=xterm", "LANG=C.UTF-8"});
  const termios before = watcher.settings();
  ASSERT_TRUE(watcher.read_until([&] {
    const auto lines = picture(watcher.written());
    return measures(lines) && shows(lines, "frame ok") && shows(lines, "▁");
  })) << watcher.written();
  const auto lines = picture(watcher.written());
  EXPECT_TRUE(fits(lines, 80, 24));
  for (const char* value : {"distance   ", "velocity   ", "signal   ", "+- ", "ring [", " % full",
                            "lost tags ", "effort "}) {
    EXPECT_TRUE(shows(lines, value)) << value;
  }
  EXPECT_EQ(watcher.settings().c_lflag & ECHO, 0u);

  watcher.resize(40, 10);
  EXPECT_TRUE(watcher.read_until([&] { return fits(picture(watcher.written()), 40, 10); }))
      << watcher.written();
  watcher.resize(120, 40);
  EXPECT_TRUE(watcher.read_until([&] {
    const auto wide = picture(watcher.written());
    return !fits(wide, 80, 40) && fits(wide, 120, 40);
  }));

  watcher.type('\003');  // Ctrl-C
  EXPECT_EQ(watcher.wait(), 0);
  EXPECT_THAT(watcher.written(), EndsWith("\033[0m\033[?25h\033[?1049l"));
  EXPECT_EQ(watcher.settings().c_lflag, before.c_lflag);
  EXPECT_EQ(watcher.settings().c_cc[VSUSP], before.c_cc[VSUSP]);
}

TEST_F(Watch, WaitsForADaemonAndSaysSoUntilSigterm) {
  TerminalProgram watcher(watch(), 80, 24, {"TERM=xterm", "LANG=C"});
  ASSERT_TRUE(watcher.read_until([&] {
    return shows(picture(watcher.written()), "no connection");
  })) << watcher.written();
  {
    Program daemon({"run", "--config", config});
    EXPECT_TRUE(watcher.read_until([&] {
      const auto lines = picture(watcher.written());
      return measures(lines) && shows(lines, "frame ok");
    })) << watcher.written();
    daemon.signal(SIGTERM);
    daemon.wait();
  }
  EXPECT_TRUE(watcher.read_until([&] {
    return shows(picture(watcher.written()), "no connection");
  })) << watcher.written();
  watcher.signal(SIGTERM);
  EXPECT_EQ(watcher.wait(), 0);
  EXPECT_THAT(watcher.written(), AllOf(EndsWith("\033[?1049l"), Not(HasSubstr("▁"))));
}

TEST_F(Watch, PrintsPlainLinesWhereThereIsNoTerminal) {
  Program daemon({"run", "--config", config});
  const test::ProgramResult heard = test::run_program(
      {"listen", "--watch", "--endpoint", endpoint, "--count", "2", "--timeout", "60"});
  EXPECT_EQ(heard.exit_code, 0) << heard.err;
  EXPECT_THAT(heard.out, AllOf(HasSubstr("distance m"), Not(HasSubstr("\033"))));

  TerminalProgram dumb({"listen", "--watch", "--endpoint", endpoint, "--count", "2"}, 80, 24,
                       {"TERM=dumb"});
  EXPECT_EQ(dumb.wait(), 0);
  EXPECT_THAT(dumb.written(), AllOf(HasSubstr("distance m"), Not(HasSubstr("\033"))));
}

// Two targets that are too close to be told apart make a pulse that is wider than the configured
// one.
TEST_F(Watch, AFrameThatIsOkSaysWhatItsLightHasAgainstThePulse) {
  Program daemon(
      {"run", "--config",
       config_with(R"("driver":"simulator","signal_per_pulse":0.01,"ambient_per_s":2000,)"
                   R"("target":{"motion":"linear","distance_m":284.5},"more_targets":)"
                   R"([{"motion":"linear","distance_m":284.522,"signal_per_pulse":0.01}])")});
  const test::ProgramResult heard =
      test::run_program({"listen", "--endpoint", endpoint, "--count", "3", "--timeout", "60"});
  EXPECT_EQ(heard.exit_code, 0) << heard.err;
  EXPECT_THAT(heard.out, ContainsRegex("  ok  pulse width 0[.][0-9]+ [+]- 0[.][0-9]+\n"));
}

// Two pixels, of which the second counts nothing, as a picture of two columns.
TEST_F(Watch, ShowsThePicturesOfAnArrayAndThePixelThatIsAskedFor) {
  const std::string array = folder.write(
      "array.json",
      R"({"schema":"splid.config","v":[1,0],"source":{)" + std::string(test::light_source) +
          R"(},"pixels":[{"name":"left","input":1,"azimuth_deg":-1,"elevation_deg":0},)"
          R"({"name":"right","input":7,"azimuth_deg":1,"elevation_deg":0}],"pattern":{"file":")" SPLID_SOURCE_DIR
          R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":")" +
          endpoint + "\"}" + test::with_light_scene(test::small_ring) + "}");
  Program daemon({"run", "--config", array});
  TerminalProgram all(watch(), 100, 40, {"TERM=xterm", "LANG=C"});
  ASSERT_TRUE(all.read_until([&] {
    const auto lines = picture(all.written());
    return shows(lines, "1 ok, 1 no_target; range ") && shows(lines, "  ==.     ==. ");
  })) << all.written();
  EXPECT_FALSE(shows(picture(all.written()), "distance   "));
  auto one = watch();
  one.insert(one.end(), {"scene", "frame/left", "--count", "30"});
  TerminalProgram left(one, 100, 40, {"TERM=xterm", "LANG=C"});
  EXPECT_TRUE(left.read_until([&] {
    const auto lines = picture(left.written());
    return shows(lines, "  ==.     ==. ") && shows(lines, "pixel left: ok") &&
           shows(lines, "distance   ");
  })) << left.written();
  EXPECT_EQ(left.wait(), 0);
}

TEST_F(Watch, ShowsTheValuesOfOnePixelAlone) {
  for (const std::vector<std::string>& topics :
       {std::vector<std::string>{"frame/a", "frame/b"}, {"frame/"}}) {
    auto words = watch();
    words.insert(words.end(), topics.begin(), topics.end());
    TerminalProgram refused(words, 80, 24, {"TERM=xterm"});
    EXPECT_EQ(refused.wait(), 2);
    EXPECT_THAT(refused.written(), HasSubstr("give one topic frame/NAME"));
  }
}

TEST_F(Watch, DoesNotGoWithJson) {
  const test::ProgramResult refused = test::run_program({"listen", "--watch", "--json"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("--watch"), HasSubstr("--json")));
}

}  // namespace
}  // namespace splid::view
