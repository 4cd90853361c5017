#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "drivers/bridge/bridge.hpp"
#include "drivers/source.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/matches.hpp"
#include "tests/support/metrics_text.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"

// The built program's metrics as Prometheus and node_exporter see them.

namespace splid {
namespace {

using nlohmann::json;
using splid::test::file_text;
using splid::test::LocalConnection;
using splid::test::MetricsText;
using splid::test::Program;
using std::chrono::steady_clock;
using test::eventually;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* get_metrics = "GET /metrics HTTP/1.1\r\nHost: splid\r\n\r\n";

class MetricsProgram : public ::testing::Test {
 protected:
  std::string config(const std::string& metrics) const {
    return folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{)" + std::string(test::light_source) +
            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
            R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":")" +
            endpoint + R"("},"metrics":)" + metrics + test::with_light_scene(test::small_ring) +
            "}");
  }

  // Where the program said that it listens; 0: it did not.
  static int port_of(const Program& program) {
    if (!eventually([&] { return program.err().find("/metrics\n") != std::string::npos; }))
      return 0;
    const auto found =
        test::first_match(program.err(), "metrics at http://127\\.0\\.0\\.1:([0-9]+)/metrics");
    return found.empty() ? 0 : std::stoi(found[1]);
  }

  static MetricsText scrape(int port) {
    const LocalConnection connection(port);
    connection.send(get_metrics);
    const std::string reply = connection.receive();
    if (!reply.starts_with("HTTP/1.1 200 ")) throw std::runtime_error("no metrics: " + reply);
    return MetricsText(reply.substr(reply.find("\r\n\r\n") + 4));
  }

  test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("frames");
};

TEST_F(MetricsProgram, TellsPrometheusAndTheFileWhatItDoes) {
  const std::string file = folder.path("splid.prom");
  Program program({"run", "--config", config(R"({"file":"splid.prom","http":"127.0.0.1:*"})")});
  const int port = port_of(program);
  ASSERT_NE(port, 0) << program.err();
  ASSERT_TRUE(eventually([&] { return scrape(port).sum("splid_frames_total") >= 3; }));
  ASSERT_TRUE(eventually([&] {
    const MetricsText text(file_text(file));  // whole whenever it is read
    return !text.names.empty() && text.sum("splid_frames_total") >= 3;
  }));
  const MetricsText text = scrape(port);
  EXPECT_GT(text("splid_tags_total{channel=\"photon\"}"), 0);
  EXPECT_EQ(text.types.at("splid_frame_latency_seconds"), "histogram");
  const LocalConnection elsewhere(port);
  elsewhere.send("GET /etc/passwd HTTP/1.0\r\n\r\n");
  EXPECT_THAT(elsewhere.receive(), HasSubstr(" 404 "));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait().exit_code, 0);
  EXPECT_EQ(MetricsText(file_text(file))("splid_state{state=\"stopping\"}"), 1);
}

// The server's library alone sleeps for up to two seconds before it lets go. Beside a stop without
// a server, since a slow machine is slow in both; a pause of the machine's own may fall into one of
// them.
TEST_F(MetricsProgram, StopsAsFastAsWithoutAServer) {
  const auto stop_time = [&](const std::string& metrics) {
    Program program({"run", "--config", config(metrics)});
    sockets::Subscriber frames(endpoint, {"frame"});
    EXPECT_TRUE(frames.receive(test::patience)) << program.err();
    const auto asked = steady_clock::now();
    program.signal(SIGTERM);
    EXPECT_EQ(program.wait().exit_code, 0);
    return steady_clock::now() - asked;
  };
  bool as_fast = false;
  for (int attempt = 0; attempt < 5 && !as_fast; ++attempt) {
    const auto without = stop_time(R"({"file":"splid.prom"})");
    as_fast = stop_time(R"({"http":"127.0.0.1:*"})") < without + std::chrono::milliseconds{500};
  }
  EXPECT_TRUE(as_fast);
}

TEST_F(MetricsProgram, WhateverComesInFramesGoOn) {
  const Program program({"run", "--config", config(R"({"http":"127.0.0.1:*"})")});
  const int port = port_of(program);
  ASSERT_NE(port, 0) << program.err();
  sockets::Subscriber frames(endpoint, {"frame"});
  std::vector<std::unique_ptr<LocalConnection>> held;
  std::string noise(1 << 20, '\0');
  for (std::size_t i = 0; i < noise.size(); ++i)
    noise[i] = static_cast<char>(i * 2654435761U >> 13U);
  std::optional<std::int64_t> last;
  for (int heard = 0; heard < 30;) {
    held.push_back(std::make_unique<LocalConnection>(port));
    const int kind = static_cast<int>(held.size() % 3);
    held.back()->send(kind == 0   ? noise.substr(0, 60'000)
                      : kind == 1 ? "GET /metrics HTTP/1.1\r\nX: " + std::string(60'000, 'a')
                                  : "GET /metr");
    const auto message = frames.receive(test::patience);
    ASSERT_TRUE(message) << program.err();
    const json frame = json_value(message->json);
    EXPECT_EQ(frame["sequence"], last.value_or(frame["sequence"].get<std::int64_t>() - 1) + 1);
    last = frame["sequence"].get<std::int64_t>();
    ++heard;
  }
  held.clear();
  EXPECT_TRUE(eventually([&] {
    try {
      return scrape(port).sum("splid_frames_total") >= 30;
    } catch (const std::runtime_error&) {
      return false;
    }
  })) << program.err();
}

TEST_F(MetricsProgram, APortInUseIsADeviceError) {
  const Program first({"run", "--config", config(R"({"http":"127.0.0.1:*"})")});
  const std::string taken = "127.0.0.1:" + std::to_string(port_of(first));
  endpoint = "ipc://" + folder.path("others");
  const auto second =
      test::run_program({"run", "--config", config(R"({"http":")" + taken + "\"}")});
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.err, AllOf(HasSubstr("metrics.http " + taken), HasSubstr("another program")));
}

// What the drivers count, though no instrument is there.
std::set<std::string> driver_counters() {
  std::set<std::string> names;
  BridgeOptions bridge;
  bridge.address = "unix:nobody";
  const auto usb = make_source_options("tdc2");
  for (const auto& source : {bridge.open({}), usb->open({})}) {
    for (const SourceCounter& counter : source->counters()) names.insert(counter.name);
  }
  return names;
}

std::set<std::string> metrics_named_in(const std::string& text) {
  const auto names = test::all_matches(text, "(splid|process)_[a-z0-9_]+");
  return {names.begin(), names.end()};
}

TEST_F(MetricsProgram, TheDashboardAndTheAlertsNameWhatThereIs) {
  Program program({"run", "--config", config(R"({"http":"127.0.0.1:*"})")});
  const int port = port_of(program);
  ASSERT_NE(port, 0) << program.err();
  MetricsText text = scrape(port);
  std::set<std::string> known = driver_counters();
  known.merge(text.names);
  const std::string dashboard = file_text(SPLID_SOURCE_DIR "/docs/reference/grafana-splid.json");
  ASSERT_FALSE(json_value_if_any(dashboard).is_discarded());
  const json whole = json_value(dashboard);
  std::set<std::string> shown;
  for (const json& panel : whole["panels"]) {
    EXPECT_FALSE(panel["targets"].empty()) << panel["title"];
    for (const json& target : panel["targets"]) {
      const auto names = metrics_named_in(target["expr"]);
      EXPECT_FALSE(names.empty()) << target;
      for (const std::string& name : names) EXPECT_TRUE(known.contains(name)) << name;
      shown.insert(names.begin(), names.end());
    }
  }
  for (const char* name : {"splid_measurement", "splid_distance_meters",
                           "splid_distance_std_meters", "splid_velocity_meters_per_second",
                           "splid_velocity_std_meters_per_second", "splid_signal_counts_per_pulse",
                           "splid_background_counts_per_second", "splid_valid_frame_age_seconds"}) {
    EXPECT_TRUE(shown.contains(name)) << name;
  }
  const std::string alerts = file_text(SPLID_SOURCE_DIR "/docs/reference/prometheus-splid.yml");
  const auto watched = metrics_named_in(alerts);
  EXPECT_EQ(watched.size(), 12U);
  for (const std::string& name : watched) EXPECT_TRUE(known.contains(name)) << name;
}

}  // namespace
}  // namespace splid
