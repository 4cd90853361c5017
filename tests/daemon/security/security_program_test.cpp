#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>

#include "tests/support/eventually.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/matches.hpp"
#include "tests/support/metrics_text.hpp"
#include "tests/support/program.hpp"

// Keys, the daemon that asks for them and the viewer that has some, by the built program.

namespace splid::security {
namespace {

using splid::test::file_text;
using splid::test::Program;
using splid::test::ProgramResult;
using splid::test::run_program;
using splid::test::TempFolder;
using test::eventually;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr const char* refused = "splid_connections_refused_total";

class SecurityProgram : public testing::Test {
 protected:
  SecurityProgram() {
    make_keys("server");
    allow("viewer", make_keys("viewer"));
  }

  // Returns the public key that was printed.
  std::string make_keys(const std::string& name) const {
    const ProgramResult made = run_program({"keys", "--output", folder.path(""), name});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return made.out.substr(0, made.out.find('\n'));
  }

  void allow(const std::string& name, const std::string& key) {
    list += key + " " + name + "\n";
    const std::string file = folder.write("allowed", list);
    ::chmod(file.c_str(), 0644);
  }

  std::string config(const std::string& publish, const std::string& security) const {
    return folder.write("config.json",
                        R"({"schema":"splid.config","v":[1,0],"source":{)" +
                            std::string(test::light_source) +
                            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
                            R"(/config/patterns/interleaved-180-189.json"},"publish":)" +
                            publish + R"(,"security":)" + security +
                            test::with_light_scene(test::small_ring) + "}");
  }
  std::string secured() const {
    return config(
        R"({"endpoint":"tcp://*:*","local_endpoint":"tcp://127.0.0.1:*"})",
        R"({"server_key":"server.key_secret","allow_list":"allowed"},"metrics":{"file":")" +
            folder.path("splid.prom") + "\"}");
  }

  // Where the program says that it publishes, seen from this machine.
  static std::string endpoint_of(const Program& program, const std::string& words) {
    std::string err;
    eventually([&] { return (err = program.err()).find("publishing at") != err.npos; });
    const auto found = test::first_match(err, words + "tcp://[0-9.]+:([0-9]+)");
    return found.empty() ? err : "tcp://127.0.0.1:" + found[1];
  }

  std::vector<std::string> listening(const std::string& endpoint, const std::string& key,
                                     const std::string& server_key) const {
    std::vector<std::string> words = {"listen", "--endpoint", endpoint, "--json", "--count", "2"};
    if (!key.empty()) words.insert(words.end(), {"--key", folder.path(key)});
    if (!server_key.empty()) words.insert(words.end(), {"--server-key", server_key});
    return words;
  }

  ProgramResult listen_in_vain(const std::string& endpoint, const std::string& key,
                               const std::string& server_key) const {
    auto words = listening(endpoint, key, server_key);
    words.insert(words.end(), {"--timeout", "4"});
    ProgramResult result = run_program(words);
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_EQ(result.out, "");
    return result;
  }

  static int lines(const std::string& text) {
    return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
  }

  const TempFolder folder;
  std::string list;
};

TEST_F(SecurityProgram, KeysAreMadeOnceAndForTheirOwner) {
  struct stat facts {};
  ASSERT_EQ(::stat(folder.path("viewer.key_secret").c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 07777U, 0600u);
  const std::string before = file_text(folder.path("viewer.key_secret"));
  const ProgramResult again = run_program({"keys", "--output", folder.path(""), "viewer"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_EQ(again.out, "");
  EXPECT_THAT(again.err, HasSubstr("never written over"));
  EXPECT_EQ(file_text(folder.path("viewer.key_secret")), before);
  const ProgramResult made = run_program({"keys", "--output", folder.path(""), "third"});
  EXPECT_EQ(made.out.size(), 41u);
  EXPECT_THAT(made.err,
              AllOf(HasSubstr(folder.path("third.key_secret")),
                    HasSubstr(made.out.substr(0, 40) + " third\n"), Not(HasSubstr("//third"))));
  EXPECT_THAT(file_text(folder.path("third.key")), HasSubstr(made.out.substr(0, 40)));
}

TEST_F(SecurityProgram, WhoIsAllowedHearsAndTheOthersAreToldWhy) {
  Program daemon({"run", "--config", secured()});
  const std::string endpoint = endpoint_of(daemon, "publishing at ");
  const std::string local = endpoint_of(daemon, "for this machine, at ");
  const std::string server = folder.path("server.key");
  const std::string stranger = make_keys("stranger");
  const std::string no_key = "it gives no CURVE key (its socket asks for NULL)";

  const ProgramResult good = run_program(listening(endpoint, "viewer.key_secret", server));
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_EQ(lines(good.out), 2);
  EXPECT_EQ(good.err, "");
  EXPECT_EQ(lines(run_program(listening(local, "", "")).out), 2);

  EXPECT_THAT(listen_in_vain(endpoint, "stranger.key_secret", server).err,
              AllOf(HasSubstr(endpoint + " refuses this key"), HasSubstr(stranger + " NAME")));
  EXPECT_THAT(listen_in_vain(endpoint, "viewer.key_secret", stranger).err,
              HasSubstr("is --server-key the key of that server"));
  // A viewer that reads all of the server's greeting at once leaves without having told what it
  // asks for. On a busy machine that may be so for some seconds.
  {
    const Program keyless(listening(endpoint, "", ""));
    EXPECT_TRUE(eventually([&] { return daemon.err().find(no_key) != std::string::npos; }));
  }
  EXPECT_THAT(listen_in_vain(endpoint, "", "").err, HasSubstr("give --key and --server-key"));
  EXPECT_THAT(listen_in_vain(local, "viewer.key_secret", server).err, HasSubstr("no CURVE"));
  EXPECT_EQ(run_program({"listen", "--key", server}).exit_code, 2);
  EXPECT_TRUE(eventually([this] {
    const std::string prometheus = file_text(folder.path("splid.prom"));
    return prometheus.find(refused) != prometheus.npos &&
           test::MetricsText(prometheus)(refused) >= 3;
  }));

  daemon.signal(SIGTERM);
  const ProgramResult ended = daemon.wait();
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_THAT(ended.err, AllOf(HasSubstr("refused 127.0.0.1: its key " + stranger.substr(0, 8)),
                               HasSubstr(" connections refused")));
  // Where the server alone has keys, the refusal names the peer, and not the server's own address.
  EXPECT_THAT(ended.err, ContainsRegex("refused 127[.]0[.]0[.]1 at [^\n]*: it gives no CURVE key"));
}

TEST_F(SecurityProgram, AReloadTakesTheListAsItIsNow) {
  Program daemon({"run", "--config", secured()});
  const std::string endpoint = endpoint_of(daemon, "publishing at ");
  const std::string late = make_keys("late");
  Program waiting(listening(endpoint, "late.key_secret", folder.path("server.key")));
  ASSERT_TRUE(
      eventually([&] { return waiting.err().find("refuses this key") != std::string::npos; }));
  folder.write("allowed", "nonsense\n");
  daemon.signal(SIGHUP);
  ASSERT_TRUE(eventually([&] { return daemon.err().find("not reloaded") != std::string::npos; }));
  EXPECT_THAT(daemon.err(), HasSubstr(folder.path("allowed") + ":1: does not begin with"));
  allow("late", late);
  daemon.signal(SIGHUP);
  const ProgramResult heard = waiting.wait();
  EXPECT_EQ(heard.exit_code, 0) << heard.err;
  EXPECT_EQ(lines(heard.out), 2);
  EXPECT_THAT(daemon.err(), HasSubstr("allow-list: 1 key added"));
  list.clear();
  allow("late", late);
  daemon.signal(SIGHUP);
  EXPECT_TRUE(eventually([&] { return daemon.err().find("1 key removed") != std::string::npos; }));
}

TEST_F(SecurityProgram, AReloadThatIsRefusedLeavesBothLists) {
  const std::string operators = folder.write("operators", list);
  ::chmod(operators.c_str(), 0644);
  Program daemon(
      {"run", "--config",
       config(R"({"endpoint":"tcp://127.0.0.1:*"})",
              R"({"server_key":"server.key_secret","allow_list":"allowed"},)"
              R"("control":{"endpoint":"tcp://127.0.0.1:*","allow_list":"operators"})")});
  (void)endpoint_of(daemon, "publishing at ");
  allow("late", make_keys("late"));
  folder.write("operators", "nonsense\n");
  daemon.signal(SIGHUP);
  ASSERT_TRUE(eventually([&] { return daemon.err().find("not reloaded") != std::string::npos; }));
  folder.write("operators", list);
  daemon.signal(SIGHUP);
  const std::string of_control = "control's allow-list: 1 key added";
  ASSERT_TRUE(eventually([&] { return daemon.err().find(of_control) != std::string::npos; }));
  EXPECT_THAT(daemon.err(), HasSubstr(": allow-list: 1 key added; " + of_control));
}

TEST_F(SecurityProgram, CheckReadsTheList) {
  EXPECT_THAT(run_program({"check", secured()}).out,
              HasSubstr("1 keys of " + folder.path("allow")));
  folder.write("allowed", "nonsense\n");
  const ProgramResult result = run_program({"check", secured()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr(folder.path("allowed") + ":1: does not begin with"));
}

TEST_F(SecurityProgram, AStartWithoutWhatItTakesIsAnError) {
  const auto fault_of = [](const std::vector<std::string>& words) {
    const ProgramResult result = run_program(words);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  };
  EXPECT_THAT(fault_of({"run", "--config", config(R"({"endpoint":"tcp://*:*"})", "{}")}),
              AllOf(HasSubstr("/publish/endpoint"), HasSubstr("security.md")));
  EXPECT_THAT(fault_of({"check", config(R"({"endpoint":"tcp://*:*"})", "{}")}),
              HasSubstr("without encryption"));
  ::chmod(folder.path("server.key_secret").c_str(), 0644);
  EXPECT_THAT(fault_of({"run", "--config", secured()}),
              AllOf(HasSubstr("mode 0644"), HasSubstr("chmod 600")));
  EXPECT_THAT(fault_of({"listen", "--key", folder.path("server.key_secret"), "--server-key",
                        folder.path("server.key")}),
              HasSubstr("mode 0644"));
  ::chmod(folder.path("server.key_secret").c_str(), 0600);
  ::chmod(folder.path("allowed").c_str(), 0666);
  EXPECT_THAT(fault_of({"run", "--config", secured()}), HasSubstr("chmod go-w"));
  std::filesystem::remove(folder.path("allowed"));
  EXPECT_THAT(fault_of({"run", "--config", secured()}),
              HasSubstr(folder.path("allowed") + ": cannot be read"));
}

}  // namespace
}  // namespace splid::security
