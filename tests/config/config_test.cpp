#include "config/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>

#include "protocol/pattern_json.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A folder with a pattern file and a configuration, minimal but for `sections`.
class ConfigTest : public ::testing::Test {
 protected:
  ConfigTest() { write_pattern(make_interleaved(std::array{180e3, 189e3})); }

  void write_pattern(const Pattern& pattern) {
    folder_.write("patterns/p.json", to_json_file(pattern));
  }

  std::string write(const std::string& sections = "") {
    return folder_.write("c.json", R"({"schema": "splid.config", "v": [1, 0],
        "source": {"driver": "simulator"}, "pattern": {"file": "patterns/p.json"})" +
                                       sections + "}");
  }

  Config load(const std::string& sections = "") { return load_config(write(sections)); }

  std::string error_of(const std::string& sections) {
    const std::string file = write(sections);
    return test::error_text([&] { load_config(file); });
  }

  std::string error_of_text(const std::string& text) {
    const std::string file = folder_.write("c.json", text);
    return test::error_text([&] { load_config(file); });
  }

  test::TempFolder folder_;
};

TEST_F(ConfigTest, EveryOtherKeyHasADefault) {
  const Config config = load();
  EXPECT_EQ(config.file, folder_.path("c.json"));
  EXPECT_EQ(config.source_driver, "simulator");
  ASSERT_NE(config.source, nullptr);
  EXPECT_EQ(config.pattern_file, folder_.path("patterns/p.json"));
  EXPECT_EQ(config.pattern.mode, Mode::interleaved);
  EXPECT_EQ(pulses_per_period(config.pattern), 40U);
  EXPECT_EQ(config.frame.length_ms, 50);
  EXPECT_THAT(config.channels.photon, ElementsAre("1"));
  EXPECT_EQ(config.publish.endpoint, "tcp://127.0.0.1:9872");
  EXPECT_EQ(config.metrics.file, "");
  EXPECT_EQ(config.metrics.http, "");
}

TEST_F(ConfigTest, ReadsEverySection) {
  const Config config = load(R"(, "channels": {"photon": [1, 2], "sync": 5, "encoder": "marker:2"},
      "pulse": {"sigma_ps": 120}, "frame": {"length_ms": 20}, "drift": {"method": "endpoints", "reference": "pattern"},
      "scene": {"motion": "static", "range_offset_m": -3}, "estimator": {"effort": "fast"},
      "detector": {"dead_time_ns": 40}, "pipeline": {"estimation_threads": 2},
      "encoder": {"file": "rail.csv", "m_per_count": -0.001, "offset_m": 7},
      "publish": {"endpoint": "ipc:///run/splid/frames"},
      "metrics": {"file": "splid.prom", "http": "localhost:9873"})");
  EXPECT_THAT(config.channels.photon, ElementsAre("1", "2"));
  EXPECT_EQ(config.channels.sync, "5");
  EXPECT_EQ(config.pulse.sigma_ps, 120);
  EXPECT_EQ(config.frame.length_ms, 20);
  EXPECT_EQ(config.drift.method, DriftMethod::endpoints);
  EXPECT_EQ(config.drift.reference, ClockReference::pattern);
  EXPECT_EQ(config.scene.motion, Motion::static_target);
  EXPECT_EQ(config.scene.range_offset_m, -3);
  EXPECT_EQ(config.estimator.effort, Effort::fast);
  EXPECT_EQ(config.detector.dead_time_ns, 40);
  EXPECT_EQ(config.pipeline.estimation_threads, 2);
  EXPECT_THAT(config.encoder.file, testing::EndsWith("/rail.csv"));
  EXPECT_EQ(config.encoder.m_per_count, -0.001);
  EXPECT_EQ(config.encoder.offset_m, 7);
  EXPECT_EQ(config.publish.endpoint, "ipc:///run/splid/frames");
  EXPECT_EQ(config.metrics.file, folder_.path("splid.prom"));
  EXPECT_EQ(config.metrics.http, "localhost:9873");
}

TEST_F(ConfigTest, TheVersionMayBeAbsentOrOfALaterMinor) {
  const std::string rest =
      R"("source": {"driver": "simulator"}, "pattern": {"file": "patterns/p.json"}})";
  EXPECT_EQ(error_of_text(R"({"schema": "splid.config", )" + rest), "");
  EXPECT_EQ(error_of_text(R"({"schema": "splid.config", "v": [1, 7], )" + rest), "");
  for (const char* version : {"[2, 0]", "[1]", "[1, -1]", "1", "\"1\"", "[0, 1]"}) {
    EXPECT_THAT(
        error_of_text(std::string(R"({"schema": "splid.config", "v": )") + version + ", " + rest),
        HasSubstr("c.json: /v: "))
        << version;
  }
}

TEST_F(ConfigTest, SaysWhatIsMissing) {
  EXPECT_THAT(error_of_text("{}"), HasSubstr("c.json: /schema: is missing"));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.pattern"})"),
              HasSubstr("c.json: is a splid pattern, but a configuration is expected here"));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.confg"})"),
              HasSubstr("/schema: \"splid.confg\" is not \"splid.config\""));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.config"})"), HasSubstr("/source: is missing"));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.config", "source": {}})"),
              HasSubstr("/source/driver: is missing"));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.config", "source": {"driver": "simulator"}})"),
              HasSubstr("/pattern: is missing"));
  EXPECT_THAT(error_of(R"(, "pattern": {"file": "patterns/p.json"})"),
              HasSubstr("/pattern: is given twice"));
  EXPECT_THAT(error_of_text("[1]"), HasSubstr("c.json: [1] is no object"));
  EXPECT_THAT(error_of_text("hello"), HasSubstr("c.json: line 1, column 1: is not JSON"));
  EXPECT_THAT(error_of_text(" \n"), HasSubstr("c.json: is empty; a configuration begins {"));
}

TEST_F(ConfigTest, AnUnknownDriverNamesTheKnownOnes) {
  const std::string error =
      error_of_text(R"({"schema": "splid.config", "source": {"driver": "simulater"}})");
  EXPECT_THAT(error, HasSubstr("/source/driver: \"simulater\" is none of "));
  EXPECT_THAT(error, HasSubstr("replay, simulator"));
  EXPECT_THAT(error, HasSubstr("did you mean simulator?"));
}

TEST_F(ConfigTest, UnknownKeysAreErrorsAtEveryDepth) {
  EXPECT_THAT(error_of(R"(, "frames": {})"), HasSubstr("/frames: is an unknown key; did "
                                                       "you mean frame?"));
  EXPECT_THAT(error_of(R"(, "frame": {"length": 50})"),
              HasSubstr("/frame/length: is an unknown key; did you mean length_ms?"));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.config",
                  "source": {"driver": "simulator", "sed": 1}})"),
              HasSubstr("/source/sed: is an unknown key; did you mean seed?"));
}

TEST_F(ConfigTest, CrossChecksNameTheirPlace) {
  EXPECT_THAT(error_of(R"(, "channels": {"photon": [1, 2], "delays_ps": [5]})"),
              HasSubstr("c.json: /channels/delays_ps: has 1 delays where /channels/photon has 2"));
  EXPECT_THAT(error_of(R"(, "channels": {"photon": [1, 2], "delays_ps": [-3e5, 3e5]})"),
              HasSubstr("c.json: /channels/delays_ps: are more than 500000 ps apart"));
  EXPECT_THAT(error_of(R"(, "channels": {"photon": [1, "marker:2"], "delays_ps": [0, 7]})"),
              HasSubstr("c.json: /channels/delays_ps/1: \"marker:2\" is no input"));
  EXPECT_THAT(
      load(R"(, "channels": {"photon": [1, 2], "delays_ps": [0, 1060]})").channels.delays_ps,
      ElementsAre(0, 1060));
  EXPECT_THAT(error_of(R"(, "channels": {"photon": 1, "sync": 1})"),
              HasSubstr("c.json: /channels/sync: \"1\" takes tags of \"1\""));
  EXPECT_THAT(error_of(R"(, "encoder": {"m_per_count": 0})"),
              HasSubstr("c.json: /encoder/m_per_count: 0 makes every count the same place"));
  EXPECT_THAT(error_of(R"(, "encoder": {"file": "a.csv", "address": "tcp:host:1"})"),
              HasSubstr("c.json: /encoder/address: the counts already come from /encoder/file"));
  EXPECT_THAT(error_of(R"(, "encoder": {"address": "host:1"})"),
              HasSubstr("c.json: /encoder/address: \"host:1\" must begin with unix: or tcp:"));
  EXPECT_THAT(error_of(R"(, "encoder": {"file": "a.csv"}, "channels": {"encoder": ""})"),
              HasSubstr("c.json: /channels/encoder: \"\" names no channel"));
  EXPECT_THAT(error_of(R"(, "publish": {"endpoint": "tcp://*:9872"})"),
              HasSubstr("c.json: /publish/endpoint: \"tcp://*:9872\" would offer"));
  EXPECT_THAT(error_of(R"(, "metrics": {"http": "http://127.0.0.1:9873"})"),
              HasSubstr("/metrics/http: \"http://127.0.0.1:9873\" is a URL; write the address"));
  EXPECT_THAT(error_of(R"(, "metrics": {"http": "0.0.0.0:9873"})"),
              HasSubstr("c.json: /metrics/http: \"0.0.0.0:9873\" would offer"));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.config", "pattern": {"file": "patterns/p.json"},
                  "source": {"driver": "simulator", "target": {"motion": "points"}}})"),
              HasSubstr("c.json: /source/target/points"));
  EXPECT_EQ(load(R"(, "scene": {"targets": 4})").scene.targets, 4);
  EXPECT_THAT(error_of(R"(, "scene": {"targets": 5})"), HasSubstr("c.json: /scene/targets"));
}

TEST_F(ConfigTest, AFittedWidthTakesTheMethodOfSearch) {
  EXPECT_EQ(load(R"(, "pulse": {"width": "fitted"})").pulse.width, PulseWidth::fitted);
  EXPECT_THAT(error_of(R"(, "pulse": {"width": "fitted"}, "estimator": {"method": "paper"})"),
              HasSubstr("c.json: /pulse/width: is \"fitted\", but the method of [P]"));
}

TEST_F(ConfigTest, AFrameHoldsAtLeastThreePatternPeriods) {
  write_pattern(make_periodic(Mode::baseline, 1e9));  // 1 ms
  EXPECT_EQ(error_of(R"(, "frame": {"length_ms": 3})"), "");
  EXPECT_THAT(error_of(R"(, "frame": {"length_ms": 2.5})"),
              HasSubstr("/frame/length_ms: 2.5 is below 3"));
}

TEST_F(ConfigTest, ATabulatedPulseNeedsACalibratedPattern) {
  EXPECT_THAT(error_of(R"(, "pulse": {"shape": "tabulated"})"), HasSubstr("/pulse/shape: "));
  Pattern pattern = make_interleaved(std::array{180e3, 189e3});
  pattern.pulse = TabulatedPulse{.first_ps = -100, .step_ps = 100, .density = {0, 1, 0}};
  write_pattern(pattern);
  EXPECT_EQ(error_of(R"(, "pulse": {"shape": "tabulated"})"), "");
}

TEST_F(ConfigTest, FilesThatCannotBeReadAreNamedWithTheirReason) {
  const std::string missing = folder_.path("missing.json");
  EXPECT_EQ(test::error_text([&] { load_config(missing); }),
            missing + ": cannot be read: No such file or directory");
  EXPECT_THAT(test::error_text([&] { load_config(folder_.path("patterns")); }),
              HasSubstr("patterns: is no file but a folder"));
  EXPECT_THAT(error_of_text(R"({"schema": "splid.config", "source": {"driver": "simulator"},
                  "pattern": {"file": "missing.json"}})"),
              StartsWith(folder_.path("c.json") + ": /pattern/file: " + missing + ": cannot be"));
}

TEST_F(ConfigTest, APatternsFaultIsTheUsersAndNamesKeyAndFile) {
  folder_.write("patterns/p.json", R"({"schema": "splid.pattern"})");
  const std::string file = write();
  try {
    load_config(file);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    EXPECT_THAT(error.what(),
                StartsWith(file + ": /pattern/file: " + folder_.path("patterns/p.json")));
  }
}

TEST_F(ConfigTest, BeyondThisMachineTakesKeysOrTheWords) {
  const std::string endpoint = R"(, "publish": {"endpoint": "tcp://*:9872"})";
  EXPECT_THAT(error_of(endpoint), AllOf(HasSubstr("/publish/endpoint: \"tcp://*:9872\""),
                                        HasSubstr("/security/server_key")));
  EXPECT_EQ(load(endpoint + R"(, "security": {"unprotected": "anyone on the network may read"})")
                .publish.endpoint,
            "tcp://*:9872");
  EXPECT_THAT(error_of(endpoint + R"(, "security": {"unprotected": "yes"})"),
              HasSubstr("/security/unprotected"));
  const Config config =
      load(endpoint + R"(, "security": {"server_key": "s", "allow_list": "keys/a"})");
  EXPECT_EQ(config.security.server_key, folder_.path("s"));
  EXPECT_EQ(config.security.allow_list, folder_.path("keys/a"));
}

TEST_F(ConfigTest, TheDumpHoldsDefaultsAndReadsBackTheSame) {
  const Config config = load(R"(, "frame": {"length_ms": 20}, "channels": {"photon": [0, 2]})");
  const std::string dump = config_to_json(config);
  EXPECT_THAT(dump, StartsWith(R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simul)"));
  EXPECT_THAT(dump, HasSubstr(R"("channels":{"photon":[0,2],"delays_ps":[],"sync":"sync",)"
                              R"("encoder":"marker:1"})"));
  EXPECT_THAT(dump, HasSubstr(R"("frame":{"length_ms":20,"by":"auto","min_seen_fraction":0.9})"));
  EXPECT_THAT(dump, HasSubstr(R"("publish":{"endpoint":"tcp://127.0.0.1:9872")"));
  const std::string again = folder_.write("again.json", dump);
  EXPECT_EQ(config_to_json(load_config(again)), dump);
}

}  // namespace
}  // namespace splid
