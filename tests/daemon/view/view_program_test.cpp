#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <csignal>
#include <list>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "protocol/json_value.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/process_memory.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sanitized.hpp"

// `splid view` as browsers, good ones and others, meet it.

namespace splid::view {
namespace {

using test::LocalConnection;
using test::Program;
using test::ProgramResult;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* live = test::light_source;

class ViewProgram : public ::testing::Test {
 protected:
  std::string config(const std::string& source) const {
    return folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
            R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":")" +
            endpoint + "\"}" + test::with_light_scene(test::small_ring) + "}");
  }

  // Starts `splid view`, on a port that the system chooses, and waits until it says which.
  void start_view(std::vector<std::string> more = {}) {
    std::vector<std::string> words{"view", "--endpoint", endpoint, "--http", "127.0.0.1:*"};
    words.insert(words.end(), more.begin(), more.end());
    view.emplace(words);
    const std::string before = "is at http://127.0.0.1:";
    ASSERT_TRUE(test::eventually([&] {
      const std::string said = view->err();
      const auto at = said.find(before);
      if (at == std::string::npos || said.find("/\n", at) == std::string::npos) return false;
      port = std::stoi(said.substr(at + before.size()));
      return true;
    })) << view->err();
  }

  std::string request(const std::string& path, const std::string& headers = "",
                      const std::string& method = "GET",
                      const std::string& host = "localhost") const {
    return method + " " + path + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" +
           headers + "\r\n";
  }

  // The whole answer to a request on a connection of its own.
  std::string answer(const std::string& request) const {
    const LocalConnection connection(port);
    connection.send(request);
    ::shutdown(connection.socket(), SHUT_WR);
    return connection.receive(5'000);
  }

  // Reads events until that text came.
  static std::string events_until(const LocalConnection& connection, const std::string& text) {
    std::string all;
    test::eventually([&] {
      all += what_came(connection);
      return all.find(text) != std::string::npos;
    });
    return all;
  }

  static std::string what_came(const LocalConnection& connection) {
    std::array<char, 65536> some{};
    const ssize_t got = ::recv(connection.socket(), some.data(), some.size(), MSG_DONTWAIT);
    return got > 0 ? std::string(some.data(), static_cast<std::size_t>(got)) : "";
  }

  void end_view() {
    view->signal(SIGTERM);
    const ProgramResult ended = view->wait();
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
  }

  test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("socket");
  std::optional<Program> view;
  int port = 0;
};

TEST_F(ViewProgram, ServesThePageItsFilesAndNothingElse) {
  start_view();
  const std::string page = answer(request("/"));
  EXPECT_THAT(page,
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("Content-Encoding: gzip"),
                    HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self'"),
                    HasSubstr("frame-ancestors 'none'"), HasSubstr("nosniff"),
                    HasSubstr("Content-Type: text/html")));
  for (const char* file : {"/view.js", "/numbers.js", "/charts.js", "/photons.js", "/field.js",
                           "/view.css", "/icon.svg"}) {
    EXPECT_THAT(answer(request(file)), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("gzip")))
        << file;
  }
  EXPECT_THAT(answer(request("/", "", "HEAD")), StartsWith("HTTP/1.1 200"));
  for (const char* other : {"/index.html", "/../etc/passwd", "//", "/events/", "/view.js/"}) {
    EXPECT_THAT(answer(request(other)), StartsWith("HTTP/1.1 404")) << other;
  }
  end_view();
}

TEST_F(ViewProgram, TheWholePageIsSmallerThan50KilobytesAndLoadsNothingFromElsewhere) {
  start_view();
  std::size_t bytes = 0;
  for (const char* file : {"/", "/view.js", "/numbers.js", "/charts.js", "/photons.js", "/field.js",
                           "/view.css", "/icon.svg"}) {
    bytes += answer(request(file)).size();
  }
  EXPECT_LT(bytes, 50'000u);
  for (const char* file :
       {"index.html", "view.js", "numbers.js", "charts.js", "photons.js", "field.js", "view.css"}) {
    const std::string text =
        test::file_text(SPLID_SOURCE_DIR "/daemon/view/page/" + std::string(file));
    ASSERT_FALSE(text.empty());
    EXPECT_THAT(
        text, AllOf(Not(HasSubstr("http:")), Not(HasSubstr("https:")), Not(HasSubstr("src=\"/")),
                    Not(HasSubstr("href=\"/")), Not(HasSubstr(" style=")), Not(HasSubstr("url("))));
  }
}

TEST_F(ViewProgram, ShowsTheMessagesAsTheyWerePublished) {
  start_view();
  Program daemon({"run", "--config", config(live)});
  Program listener({"listen", "--endpoint", endpoint, "--json", "frame"});
  const LocalConnection viewer(port);
  viewer.send(request("/events?seconds=10"));
  std::string events = events_until(viewer, "event: frame");
  EXPECT_THAT(events,
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("text/event-stream"),
                    HasSubstr("event: version\ndata: {"), HasSubstr("event: bins\ndata: {")));
  // A frame that both heard.
  const std::string head = "event: frame\ndata: ";
  std::string frame;
  ASSERT_TRUE(test::eventually([&] {
    events += what_came(viewer);
    const auto end = events.rfind("}\n\n");
    const auto at = events.rfind(head, end);
    if (at == std::string::npos) return false;
    frame = events.substr(at + head.size(), events.find('\n', at + head.size()) - at - head.size());
    return frame.ends_with('}') && listener.out().find(frame) != std::string::npos;
  })) << frame;
  EXPECT_THAT(events_until(viewer, "event: status"), HasSubstr("event: status"));
  EXPECT_EQ(json_value(frame)["schema"], "splid.frame");
  end_view();
}

TEST_F(ViewProgram, AsksForThePicturesOfThePhotonsWhileSomebodyLooksAtThem) {
  start_view();
  Program daemon({"run", "--config", config(live)});
  const LocalConnection viewer(port);
  viewer.send(request("/events"));
  EXPECT_THAT(events_until(viewer, "event: frame"), HasSubstr("event: frame"));
  {
    const LocalConnection looker(port);
    looker.send(request("/events?seconds=10&fold=1"));
    EXPECT_THAT(events_until(looker, "\"gain_nats\""),
                HasSubstr("event: fold\ndata: {\"schema\":\"splid.fold\""));
  }
  // For longer than a second, which is how often the pictures would come.
  std::string later;
  for (int i = 0; i < 3; ++i) later += events_until(viewer, "event: status");
  EXPECT_THAT(later, AllOf(HasSubstr("event: frame"), Not(HasSubstr("event: fold"))));
  end_view();
}

TEST_F(ViewProgram, WaitsForTheDaemonAndFindsItAgain) {
  start_view();
  const LocalConnection viewer(port);
  viewer.send(request("/events"));
  EXPECT_THAT(events_until(viewer, "\"trouble\":\"n"), HasSubstr(endpoint));
  for (int i = 0; i < 2; ++i) {
    Program daemon({"run", "--config", config(live)});
    EXPECT_THAT(events_until(viewer, "event: frame"), HasSubstr("\"trouble\":\"\""));
    daemon.signal(SIGTERM);
    daemon.wait();
    EXPECT_THAT(events_until(viewer, "\"trouble\":\"n"), HasSubstr(endpoint));
  }
  EXPECT_THAT(view->err(), HasSubstr(endpoint));
}

TEST_F(ViewProgram, RefusesForeignHostsOriginsAndMethodsAndCountsThem) {
  start_view();
  const std::string own = "127.0.0.1:" + std::to_string(port);
  EXPECT_THAT(answer(request("/", "Origin: http://" + own + "\r\n", "GET", own)),
              StartsWith("HTTP/1.1 200"));
  int refused = 0;
  const auto expect_refused = [&](const std::string& text, const std::string& code) {
    EXPECT_THAT(answer(text), AllOf(StartsWith("HTTP/1.1 " + code), Not(HasSubstr("event:"))))
        << text;
    ++refused;
  };
  for (const char* path : {"/", "/events", "/view.js"}) {
    expect_refused(request(path, "", "GET", "evil.example"), "403");
    expect_refused(request(path, "Origin: http://evil.example\r\n", "GET", own), "403");
    expect_refused(request(path, "Origin: null\r\n", "GET", own), "403");
    for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "BREW"}) {
      expect_refused(request(path, "Content-Length: 0\r\n", method), "405");
    }
  }
  expect_refused("GET / HTTP/1.0\r\n\r\n", "403");
  // What libmicrohttpd would hand over as localhost, and as the page's own origin.
  expect_refused(request("/", "", "GET", std::string("localhost\0.evil", 15)), "400");
  expect_refused(request("/", "", "GET", std::string("localhost\0\0.evil", 16)), "400");
  expect_refused(request(std::string("/\0.evil", 7)), "400");
  expect_refused(request("/", std::string("Origin: http://localhost\0.evil\r\n", 32)), "400");
  const LocalConnection viewer(port);
  viewer.send(request("/events"));
  EXPECT_THAT(events_until(viewer, "event: page"),
              HasSubstr("\"refused\":" + std::to_string(refused)));
}

TEST_F(ViewProgram, LivesThroughNonsenseHugeHeadersAndFiveHundredConnections) {
  Program daemon({"run", "--config", config(live)});
  start_view();
  Program listener({"listen", "--endpoint", endpoint, "--json", "frame"});
  const LocalConnection viewer(port);
  viewer.send(request("/events"));
  events_until(viewer, "event: frame");
  for (const std::string& nonsense :
       {std::string("\0\xff\r\n\r\n", 6), std::string("GET\r\n\r\n"), std::string(100'000, 'A'),
        request("/" + std::string(100'000, 'a')),
        request("/", "X: " + std::string(1'000'000, 'x') + "\r\n"),
        request("/events?seconds=" + std::string(500, '9')).substr(0, 60),
        request("/", "Content-Length: 99999999999999999999\r\n", "POST"),
        request("/", "Transfer-Encoding: chunked\r\n", "POST") + "zzz\r\n"}) {
    EXPECT_THAT(answer(nonsense), Not(StartsWith("HTTP/1.1 200")));
  }
  std::list<LocalConnection> crowd;
  for (int i = 0; i < 500; ++i) crowd.emplace_back(port).send("GET / HT");
  // The viewer that was there goes on, and hears in the end that all beyond 64 were refused.
  const std::string events = events_until(viewer, "\"refused\":4");
  EXPECT_THAT(events, HasSubstr("event: frame"));
  EXPECT_LT(test::memory_mib("VmRSS", std::to_string(view->id())), 200);
  crowd.clear();
  EXPECT_TRUE(test::eventually([&] { return answer(request("/")).starts_with("HTTP/1.1 200"); }));
  // Nothing of it reached the daemon: whoever listened beside it missed no frame.
  listener.signal(SIGINT);
  std::istringstream heard(listener.wait().out);
  std::optional<std::uint64_t> last;
  for (std::string line; std::getline(heard, line);) {
    const auto sequence = json_value(line)["sequence"].get<std::uint64_t>();
    if (last) {
      EXPECT_EQ(sequence, *last + 1);
    }
    last = sequence;
  }
  EXPECT_TRUE(last);
  end_view();
}

TEST_F(ViewProgram, ViewersThatReadNothingCostNoMemoryAndTheOthersNothing) {
  start_view();
  std::list<LocalConnection> sleepers;
  for (int i = 0; i < 10; ++i) sleepers.emplace_back(port).send(request("/events?seconds=3600"));
  const LocalConnection viewer(port);
  viewer.send(request("/events?seconds=10"));
  // A minute of frames, as fast as they come.
  const std::string seconds = std::to_string(test::times(60));
  Program daemon({"run", "--config", config(live + (R"(,"pace":"max","seconds":)" + seconds))});
  events_until(viewer, "event: frame");
  daemon.wait();
  EXPECT_THAT(events_until(viewer, "stopping"), HasSubstr("event: bins"));
  EXPECT_LT(test::memory_mib("VmHWM", std::to_string(view->id())), 200);
  end_view();
}

TEST_F(ViewProgram, RefusesMoreViewersThanThereMayBe) {
  start_view();
  std::list<LocalConnection> viewers;
  for (int i = 0; i < 16; ++i) {
    viewers.emplace_back(port).send(request("/events"));
    EXPECT_THAT(events_until(viewers.back(), "event: page"), HasSubstr("200 OK"));
  }
  EXPECT_THAT(answer(request("/events")), StartsWith("HTTP/1.1 503"));
  viewers.pop_back();
  const auto serves = [&] {
    const LocalConnection another(port);
    another.send(request("/events"));
    return events_until(another, "\r\n\r\n").starts_with("HTTP/1.1 200");
  };
  EXPECT_TRUE(test::eventually(serves));
}

TEST_F(ViewProgram, ErrorsNameTheOption) {
  start_view();
  const auto expect_error = [](const std::vector<std::string>& words, int code, const auto& said) {
    const ProgramResult result = run_program(words);
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, said);
  };
  const std::string taken = "127.0.0.1:" + std::to_string(port);
  expect_error({"view", "--endpoint", endpoint, "--http", taken}, 3,
               AllOf(HasSubstr("--http"), HasSubstr(taken), HasSubstr("in use")));
  expect_error({"view", "--http", "lab"}, 2, HasSubstr("--http"));
  expect_error({"view", "--endpoint", endpoint, "--http", std::to_string(port)}, 3,
               AllOf(HasSubstr("--http"), HasSubstr(taken), HasSubstr("in use")));
  expect_error({"view", "--endpoint", "9872"}, 2, HasSubstr("9872"));
  expect_error({"view", "--key", folder.path("none")}, 2, HasSubstr("--server-key"));
  expect_error({"view", "--key", folder.path("none"), "--server-key", folder.path("none")}, 2,
               AllOf(HasSubstr("--key"), HasSubstr(folder.path("none"))));
}

TEST_F(ViewProgram, SaysWhoCanReadWhereItIsOpenToTheNetwork) {
  Program open({"view", "--endpoint", endpoint, "--http", "*:*"});
  EXPECT_TRUE(test::eventually([&] {
    return open.err().find("everybody who reaches *:* over the network") != std::string::npos;
  })) << open.err();
  open.signal(SIGTERM);
  EXPECT_EQ(open.wait().exit_code, 0);
}

TEST_F(ViewProgram, SaysThatItsKeyIsRefused) {
  const auto key = [&](const std::string& name) {
    run_program({"keys", "--output", folder.path(""), name});
    return folder.path(name) + ".key";
  };
  const std::string server = key("server");
  const std::string stranger = key("stranger");
  folder.write("allowed", "");
  endpoint = "tcp://127.0.0.1:*";
  std::string guarded = test::file_text(config(live));
  guarded.insert(guarded.rfind('}'),
                 R"(,"security":{"server_key":"server.key_secret","allow_list":"allowed"})");
  Program daemon({"run", "--config", folder.write("guarded.json", guarded)});
  const std::string before = "publishing at ";
  ASSERT_TRUE(test::eventually([&] {
    const std::string said = daemon.err();
    const auto at = said.find(before);
    if (at == std::string::npos || said.find('\n', at) == std::string::npos) return false;
    endpoint = said.substr(at + before.size(),
                           said.find_first_of(" ,;\n", at + before.size()) - at - before.size());
    return true;
  })) << daemon.err();
  start_view({"--key", stranger + "_secret", "--server-key", server});
  const LocalConnection viewer(port);
  viewer.send(request("/events"));
  EXPECT_THAT(events_until(viewer, "refuses this key"),
              AllOf(HasSubstr("refuses this key"), Not(HasSubstr("event: frame"))))
      << view->err();
}

}  // namespace
}  // namespace splid::view
