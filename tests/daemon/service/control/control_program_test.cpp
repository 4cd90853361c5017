#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "tests/support/control_peer.hpp"
#include "tests/support/control_scene.hpp"
#include "tests/support/notify_socket.hpp"
#include "tests/support/process_memory.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/yardstick.hpp"

// The built program under control: as splid ctl asks, and as others might.

namespace splid::control {
namespace {

using std::chrono::milliseconds;
using test::ControlPeer;
using test::eventually;
using test::ProgramResult;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using Control = test::ControlScene;

std::string asking(const std::string& request) {
  return R"({"schema":"splid.control","v":[1,0],"request":")" + request + "\"}";
}

TEST_F(Control, SaysHowItDoesInWordsAndInJson) {
  run(configure());
  struct stat found {};
  ASSERT_EQ(::stat(socket.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
  ProgramResult words;
  // On a machine that is slow the effort is lowered, or a block comes late.
  EXPECT_TRUE(eventually([&] {
    words = ctl({"status"});
    return words.out.starts_with("state       streaming") ||
           words.out.starts_with("state       degraded");
  }));
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_THAT(words.out, AllOf(HasSubstr("measurement "), HasSubstr("with a target"),
                               HasSubstr("recording   no")));
  EXPECT_THAT(words.err, IsEmpty());
  const ProgramResult json = ctl({"status", "--json"});
  EXPECT_THAT(json.out,
              AllOf(HasSubstr(R"("request":"status","ok":true)"), HasSubstr(R"("measuring":true)"),
                    HasSubstr(R"("status":{"schema":"splid.status")")));
  EXPECT_EQ(std::count(json.out.begin(), json.out.end(), '\n'), 1);
  const std::string config = folder.path("config.json");
  EXPECT_EQ(run_program({"ctl", "--config", config, "status"}).exit_code, 0);
  end();
  EXPECT_FALSE(std::filesystem::exists(socket));
}

TEST_F(Control, StopsAndStartsAndSaysSo) {
  run(configure());
  sockets::Subscriber subscriber(frames, {topic_status});
  EXPECT_THAT(ctl({"start"}).err, HasSubstr("it is measuring already"));
  const ProgramResult stopped = ctl({"stop"});
  EXPECT_EQ(stopped.exit_code, 0);
  EXPECT_THAT(stopped.err, HasSubstr("stopped; the source is closed"));
  EXPECT_THAT(stopped.out, IsEmpty());
  EXPECT_THAT(ctl({"stop"}).err, HasSubstr("it is stopped already"));
  EXPECT_TRUE(eventually([&] {
    const auto message = subscriber.receive(milliseconds{100});
    return message && message->json.find("waiting_for_device") != std::string::npos &&
           message->json.find("stopped by control") != std::string::npos;
  }));
  EXPECT_THAT(status(), AllOf(HasSubstr(R"("measuring":false)"), HasSubstr("waiting_for_device")));
  EXPECT_THAT(ctl({"start"}).err, HasSubstr("measuring"));
  EXPECT_TRUE(eventually([this] { return measures(); }));
  // Its end while it does not measure is as any other.
  const ProgramResult again = ctl({"stop"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  end();
  EXPECT_TRUE(eventually([&] {
    const auto message = subscriber.receive(milliseconds{100});
    return message && message->json.find("\"stopping\"") != std::string::npos;
  }));
}

std::size_t descriptors_of(const std::string& process) {
  const std::filesystem::directory_iterator all("/proc/" + process + "/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

TEST_F(Control, TwentyTimesStoppedAndStartedTheFramesAreOneRowAndNothingGrows) {
  run(configure());
  const test::FrameWatch watch(frames);
  ASSERT_TRUE(eventually([&] { return watch.frames() > 0; }));
  const std::string process = std::to_string(daemon->id());
  std::size_t descriptors = 0;
  [[maybe_unused]] double resident_mib = 0;  // sanitizers keep what was freed
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(ctl({"stop"}).exit_code, 0) << i;
    const int before = watch.frames();
    ASSERT_EQ(ctl({"start"}).exit_code, 0) << i;
    ASSERT_TRUE(eventually([&] { return watch.frames() > before; })) << i;
    if (i != 4) continue;
    descriptors = descriptors_of(process);
    resident_mib = test::memory_mib("VmRSS", process);
  }
  EXPECT_EQ(watch.missing(), 0);
  EXPECT_LE(descriptors_of(process), descriptors + 2);
#ifndef SPLID_SANITIZED
  EXPECT_LT(test::memory_mib("VmRSS", process), resident_mib + 40);
#endif
  end();
}

TEST_F(Control, EveryBadRequestHasItsSentence) {
  run(configure());
  ControlPeer peer(endpoint);
  EXPECT_THAT(peer.ask("garbage"), AllOf(HasSubstr(R"("ok":false)"), HasSubstr("is not JSON"),
                                         HasSubstr(R"("fault":"usage")")));
  EXPECT_THAT(peer.ask(asking("fire")), HasSubstr("/request: \\\"fire\\\" is none of status"));
  EXPECT_THAT(peer.ask(R"({"schema":"splid.control","request":"stop","now":true})"),
              HasSubstr("/now"));
  peer.send({asking("stop"), "and more"});
  EXPECT_THAT(peer.receive(), HasSubstr("must be one part of JSON"));
  peer.send({"", asking("stop"), "and", "more", "of", "it"});
  EXPECT_THAT(peer.receive(), HasSubstr("must be one part of JSON"));
  peer.send({""});
  EXPECT_THAT(peer.receive(), HasSubstr("is not JSON"));
  EXPECT_THAT(peer.ask(asking("record_start")), HasSubstr("/record/folder"));
  EXPECT_THAT(peer.ask(asking("upload")), HasSubstr("awg/address: is missing"));
  EXPECT_THAT(peer.ask(asking("status")), HasSubstr(R"("measuring":true)"));

  ControlPeer other(endpoint, zmq::socket_type::req);
  EXPECT_THAT(other.ask(asking("status")), HasSubstr(R"("ok":true)"));
  EXPECT_EQ(ctl({"record", "start"}).exit_code, 2);
  EXPECT_EQ(ctl({"upload"}).exit_code, 2);
  EXPECT_EQ(ctl({"record"}).exit_code, 2);
  EXPECT_EQ(ctl({"stop", "--config", "x", "--endpoint", endpoint}).exit_code, 2);
  end();
}

TEST_F(Control, EightAtOnceEachGetAnAnswer) {
  run(configure());
  std::atomic<int> done{0};
  std::atomic<int> busy{0};
  {
    std::vector<std::jthread> clients;
    for (int i = 0; i < 8; ++i) {
      clients.emplace_back([&, i] {
        ControlPeer peer(endpoint);
        for (int k = 0; k < 10; ++k) {
          const std::string reply = peer.ask(asking((i + k) % 2 == 0 ? "stop" : "start"));
          done += reply.find(R"("ok":true)") != std::string::npos ? 1 : 0;
          busy += reply.find("busy: st") != std::string::npos ? 1 : 0;
          EXPECT_THAT(peer.ask(asking("status")), HasSubstr(R"("ok":true)"));
        }
      });
    }
  }
  EXPECT_GT(done, 0);
  EXPECT_EQ(done + busy, 80);
  EXPECT_EQ(ctl({"start"}).exit_code, 0);
  EXPECT_TRUE(eventually([this] { return measures(); }));
  end();
}

TEST_F(Control, GarbageCostsNoFrame) {
  run(configure());
  const test::FrameWatch watch(frames);
  ASSERT_TRUE(eventually([&] { return watch.frames() > 0; }));
  // Never reads: as many of 10,000 as it is rid of. A daemon that has shut it out takes no more,
  // and its own queue is then full.
  ControlPeer deaf(endpoint, zmq::socket_type::dealer, 0);
  for (int i = 0; i < 10'000; ++i) deaf.send({asking("status")});
  for (int i = 0; i < 200; ++i) {
    ControlPeer vanishing(endpoint);
    vanishing.send({std::string(static_cast<std::size_t>(i), '{')});
    vanishing.send({std::string(i % 2 == 0 ? 4096 : 1'000'000, '\xff')});
    vanishing.send(std::vector<std::string>(static_cast<std::size_t>(1 + i % 20), "{}"));
  }
  const int before = watch.frames();
  EXPECT_THAT(status(), HasSubstr(R"("ok":true)"));
  EXPECT_TRUE(eventually([&] { return watch.frames() > before + 10; }));
  EXPECT_EQ(watch.missing(), 0);
  end();
}

TEST_F(Control, ASecondDaemonDoesNotTakeItOver) {
  run(configure());
  const std::string other = folder.write("other.json", [this] {
    std::string text = test::file_text(folder.path("config.json"));
    return text.replace(text.find(frames), frames.size(), frames + "2");
  }());
  const ProgramResult second = run_program({"run", "--config", other});
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.err, HasSubstr("another splid is controlled there"));
  EXPECT_THAT(status(), HasSubstr(R"("ok":true)"));
  // One that was killed leaves its file, which is no obstacle.
  daemon->signal(SIGKILL);
  (void)daemon->wait();
  EXPECT_TRUE(std::filesystem::exists(socket));
  run(configure());
  end();
}

TEST_F(Control, NobodyThereIsADeviceErrorThatNamesThePlace) {
  const ProgramResult absent = ctl({"status"});
  EXPECT_EQ(absent.exit_code, 3);
  EXPECT_THAT(absent.err, AllOf(HasSubstr("no splid answers at " + endpoint),
                                HasSubstr("is the service running?")));
  // A daemon that is there and says nothing.
  run(configure());
  daemon->signal(SIGSTOP);
  const test::Yardstick yardstick;
  const auto begin = std::chrono::steady_clock::now();
  const ProgramResult silent = ctl({"status"});
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  EXPECT_TRUE(yardstick.keeps(2000, took.count()));
  EXPECT_EQ(silent.exit_code, 3);
  EXPECT_THAT(silent.err, HasSubstr("no splid answers at " + endpoint));
  daemon->signal(SIGCONT);
  end();
  for (const char* nowhere : {"tcp://127.0.0.1:1", "off", "udp://x"}) {
    EXPECT_EQ(run_program({"ctl", "--endpoint", nowhere, "status"}).exit_code, 2) << nowhere;
  }
}

// A source that cannot be opened keeps the daemon waiting, and start says why.
TEST_F(Control, StartSaysWhatKeepsItFromMeasuring) {
  const std::string moving = configure(R"("driver":"simulator","pace":"max")");
  const std::string recording = folder.path("r.ptu");
  ASSERT_EQ(run_program({"simulate", "-c", moving, "--seconds", "20", "-o", recording}).exit_code,
            0);
  run(configure(R"("driver":"replay","speed":1,"recording":")" + recording + '"'));
  const test::FrameWatch watch(frames);
  ASSERT_TRUE(eventually([&] { return watch.frames() > 0; }));
  EXPECT_EQ(ctl({"stop"}).exit_code, 0);
  std::filesystem::rename(recording, recording + ".away");
  const ProgramResult refused = ctl({"start"});
  EXPECT_EQ(refused.exit_code, 4);  // as the replay driver has it
  EXPECT_THAT(refused.err, HasSubstr(recording));
  EXPECT_THAT(ctl({"status"}).out, AllOf(HasSubstr("waiting_for_device"), HasSubstr(recording)));
  std::filesystem::rename(recording + ".away", recording);
  const int before = watch.frames();
  EXPECT_EQ(ctl({"start"}).exit_code, 0);
  EXPECT_TRUE(eventually([&] { return watch.frames() > before; }));
  EXPECT_EQ(watch.missing(), 0);
  end();
}

TEST_F(Control, TheServiceManagerHearsThatItWaits) {
  test::NotifySocket manager("400000");
  run(configure());
  EXPECT_EQ(ctl({"stop"}).exit_code, 0);
  EXPECT_TRUE(manager.hears("STATUS=waiting for device"));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  end();
  EXPECT_TRUE(manager.hears("STOPPING=1"));
}

// Where the log says that it listens; empty: not yet.
std::string port_of(const std::string& log) {
  const std::string before = "control at ";
  const std::size_t at = log.find(before);
  if (at == std::string::npos) return "";
  return log.substr(at + before.size(), log.find('\n', at) - at - before.size());
}

TEST_F(Control, OverTcpKnowsWhoAsks) {
  const auto keys = [this](const std::string& name) {
    const std::string text = run_program({"keys", "--output", folder.path(""), name}).out;
    return text.substr(0, text.find('\n'));
  };
  keys("server");
  const std::string anna = keys("anna");
  keys("stranger");
  folder.write("readers", anna + " anna\n");
  folder.write("allowed", anna + " anna\n");
  const std::string security =
      R"("security":{"server_key":"server.key_secret","allow_list":"readers"})";
  std::string text = test::file_text(configure());
  const std::string plain = R"("control":{"endpoint":")" + endpoint + "\"}";
  const auto with = [&](const std::string& control, const std::string& more) {
    std::string changed = text;
    changed.replace(changed.find(plain), plain.size(), R"("control":{)" + control + "}" + more);
    return folder.write("tcp.json", changed);
  };
  const std::string port = R"("endpoint":"tcp://127.0.0.1:*")";
  EXPECT_THAT(run_program({"run", "-c", with(port, "")}).err, HasSubstr("/control/allow_list"));
  EXPECT_THAT(run_program({"run", "-c", with(port + R"(,"allow_list":"allowed")", "")}).err,
              HasSubstr("takes /security/server_key"));
  daemon = std::make_unique<test::Program>(std::vector<std::string>{
      "run", "-c", with(port + R"(,"allow_list":"allowed")", "," + security)});
  ASSERT_TRUE(eventually([this] { return !port_of(daemon->err()).empty(); }));
  const auto ask = [&](const std::string& who, const std::string& what) {
    return run_program({"ctl", "-e", port_of(daemon->err()), "--key",
                        folder.path(who + ".key_secret"), "--server-key", folder.path("server.key"),
                        what});
  };
  EXPECT_EQ(ask("anna", "stop").exit_code, 0);
  EXPECT_THAT(ask("anna", "status").out, HasSubstr("stopped by control"));
  const ProgramResult stranger = ask("stranger", "start");
  EXPECT_EQ(stranger.exit_code, 3);
  EXPECT_THAT(stranger.err, HasSubstr("refuses this key"));
  EXPECT_THAT(ask("anna", "status").out, HasSubstr("stopped by control"));
  EXPECT_EQ(run_program({"ctl", "-e", port_of(daemon->err()), "status"}).exit_code, 2);
  ControlPeer without(port_of(daemon->err()), zmq::socket_type::dealer, 500);
  EXPECT_EQ(without.ask(asking("start")), "");
  end();
}

}  // namespace
}  // namespace splid::control
