#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/eventually.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

// `splid demo`: a simulated target and its page in one command.

namespace splid::view {
namespace {

using test::LocalConnection;
using test::Program;
using test::ProgramResult;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class DemoProgram : public ::testing::Test {
 protected:
  std::vector<std::string> words(const std::string& http = "127.0.0.1:*") const {
    return {"demo", "--endpoint", endpoint, "--http", http};
  }

  // The port of the page, once the demonstration says which; 0 where it never does.
  static int page_of(const Program& demo) {
    int port = 0;
    test::eventually([&] {
      const std::string before = "open http://127.0.0.1:";
      const std::string said = demo.err();
      const auto at = said.find(before);
      if (at == std::string::npos || said.find(" in a browser", at) == std::string::npos) {
        return false;
      }
      port = std::stoi(said.substr(at + before.size()));
      return true;
    });
    return port;
  }

  // The begin of the last frame in these events, in seconds of the tagger's clock; 0: there is
  // none.
  static double last_start_s(const std::string& events) {
    const std::string before = "\"start_ps\":\"";
    const auto at = events.rfind(before);
    if (at == std::string::npos || events.find('"', at + before.size()) == std::string::npos) {
      return 0;
    }
    return std::stod(events.substr(at + before.size())) * 1e-12;
  }

  // What the page is sent until a frame begins at or after that time, or nothing more comes.
  static std::string events_until(int port, double start_s) {
    const LocalConnection viewer(port);
    viewer.send("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
    std::string all;
    ssize_t got = 0;
    std::array<char, 65536> some{};
    const auto something_comes = [&] {
      got = ::recv(viewer.socket(), some.data(), some.size(), MSG_DONTWAIT);
      return got >= 0;
    };
    while (last_start_s(all) < start_s && test::eventually(something_comes) && got > 0) {
      all.append(some.data(), static_cast<std::size_t>(got));
    }
    return all;
  }

  static void end(Program& demo, int signal) {
    demo.signal(signal);
    const ProgramResult ended = demo.wait();
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
  }

  test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("socket");
};

TEST_F(DemoProgram, MeasuresAndServesThePageUntilItIsInterrupted) {
  Program demo(words());
  const int port = page_of(demo);
  ASSERT_NE(port, 0) << demo.err();
  // Longer than the ten seconds that demo.json has.
  const std::string events = events_until(port, 10.5);
  EXPECT_GE(last_start_s(events), 10.5);
  EXPECT_THAT(events, AllOf(HasSubstr("event: version"), HasSubstr("\"status\":\"ok\"")));
  end(demo, SIGINT);
  EXPECT_FALSE(std::filesystem::exists(folder.path("socket")));
  Program again(words("127.0.0.1:" + std::to_string(port)));
  EXPECT_EQ(page_of(again), port) << again.err();
  end(again, SIGTERM);
}

TEST_F(DemoProgram, SaysWhichPortIsInUseAndWhatToDo) {
  Program first(words());
  const int port = page_of(first);
  ASSERT_NE(port, 0) << first.err();
  // Its page comes before its frames.
  ASSERT_GT(last_start_s(events_until(port, 0.1)), 0);
  const std::string taken = "127.0.0.1:" + std::to_string(port);
  const ProgramResult same_page =
      run_program({"demo", "--endpoint", endpoint + "2", "--http", taken});
  EXPECT_EQ(same_page.exit_code, 3);
  EXPECT_THAT(same_page.err, AllOf(HasSubstr("--http"), HasSubstr(taken), HasSubstr("in use"),
                                   Not(HasSubstr("in a browser"))));
  const ProgramResult same_endpoint = run_program(words());
  EXPECT_EQ(same_endpoint.exit_code, 3);
  EXPECT_THAT(same_endpoint.err,
              AllOf(HasSubstr(endpoint), HasSubstr("simulator"), HasSubstr("systemctl stop splid"),
                    HasSubstr("--endpoint"), Not(HasSubstr("demo.json an endpoint"))));
  const ProgramResult unknown_port = run_program({"demo", "--endpoint", "tcp://127.0.0.1:*"});
  EXPECT_EQ(unknown_port.exit_code, 2);
  EXPECT_THAT(unknown_port.err, HasSubstr("tcp://127.0.0.1:*"));
  end(first, SIGINT);
}

TEST_F(DemoProgram, FindsItsConfigurationWhereItIsInstalled) {
  namespace fs = std::filesystem;
  fs::create_directories(folder.path("bin"));
  const std::string program = folder.path("bin/splid");
  fs::copy(SPLID_BINARY, program);
  const ProgramResult alone = Program(words(), program).wait();
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.err, AllOf(HasSubstr("demo.json"), HasSubstr("share/splid")));

  fs::create_directories(folder.path("share/splid"));
  fs::copy(SPLID_SOURCE_DIR "/config/demo.json", folder.path("share/splid/demo.json"));
  fs::copy(SPLID_SOURCE_DIR "/config/patterns", folder.path("share/splid/patterns"));
  Program installed(words(), program);
  EXPECT_NE(page_of(installed), 0) << installed.err();
  EXPECT_THAT(installed.err(), HasSubstr(folder.path("share/splid/patterns")));
  end(installed, SIGINT);
}

}  // namespace
}  // namespace splid::view
