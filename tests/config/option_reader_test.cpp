#include "config/option_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/json_value.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/every_option.hpp"

namespace splid {
namespace {

using test::EveryOption;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

EveryOption read(const std::string& text) {
  const auto json = json_value(text);
  OptionReader reader(json, "folder/a.json", "/source");
  EveryOption options;
  options.describe(reader);
  reader.finish();
  return options;
}

std::string reader_error(const std::string& text) {
  return test::error_text([&] { read(text); });
}

TEST(OptionReader, LeavesDefaultsWhereTheTextIsSilent) { EXPECT_EQ(read("{}"), EveryOption{}); }

TEST(OptionReader, ReadsEveryKind) {
  const EveryOption options = read(R"({"length_ms": 0.5, "start_s": 10, "count": 8, "live": false,
      "name": "n", "recording": "/data/a.ptu", "colour": "green", "times_s": [], "sync": "marker:2",
      "photon": [1, "2"], "target": {"distance_m": 7}, "targets": [{"distance_m": 8}]})");
  EXPECT_EQ(options.length_ms, 0.5);
  EXPECT_EQ(options.start_s, 10.0);
  EXPECT_EQ(options.count, 8);
  EXPECT_FALSE(options.live);
  EXPECT_EQ(options.name, "n");
  EXPECT_EQ(options.recording, "/data/a.ptu");
  EXPECT_EQ(options.colour, EveryOption::Colour::green);
  EXPECT_TRUE(options.times_s.empty());
  EXPECT_EQ(options.sync, "marker:2");
  EXPECT_THAT(options.photon, ElementsAre("1", "2"));
  EXPECT_EQ(options.target.distance_m, 7);
  ASSERT_EQ(options.targets.size(), 1U);
  EXPECT_EQ(options.targets[0].distance_m, 8);
}

TEST(OptionReader, RelativePathsStartAtTheFile) {
  EXPECT_EQ(read(R"({"recording": "../b.ptu"})").recording, "b.ptu");
  EXPECT_EQ(read(R"({"recording": "b.ptu"})").recording, "folder/b.ptu");
  EXPECT_THAT(reader_error(R"({"recording": ""})"),
              HasSubstr("/source/recording: \"\" names no file"));
}

TEST(OptionReader, PairsAreReadAndTheirFaultsNamed) {
  EXPECT_THAT(read(R"({"table": [[0, 3], [9, -3]]})").table,
              ElementsAre(NumberPair{0, 3}, NumberPair{9, -3}));
  EXPECT_TRUE(read(R"({"table": []})").table.empty());
  EXPECT_THAT(reader_error(R"({"table": 1})"), HasSubstr("/source/table: 1 is no array of pairs"));
  EXPECT_THAT(reader_error(R"({"table": [[1, 2, 3]]})"),
              HasSubstr("/source/table/0: [1,2,3] is no pair"));
  EXPECT_THAT(reader_error(R"({"table": [[1, 2], 3]})"),
              HasSubstr("/source/table/1: 3 is no pair"));
  EXPECT_THAT(reader_error(R"({"table": [[1, 4]]})"), HasSubstr("/source/table/0/1: 4 is above 3"));
}

TEST(OptionReader, AChannelMayBeANumberAndAlone) {
  EXPECT_THAT(read(R"({"photon": 3})").photon, ElementsAre("3"));
  EXPECT_THAT(read(R"({"photon": "sync"})").photon, ElementsAre("sync"));
  EXPECT_EQ(read(R"({"sync": 5})").sync, "5");
  EXPECT_EQ(read(R"({"sync": ""})").sync, "");
  EXPECT_THAT(reader_error(R"({"photon": [1, "two"]})"), HasSubstr("/source/photon/1: \"two\""));
  EXPECT_THAT(reader_error(R"({"sync": 1.0})"), HasSubstr("/source/sync: 1.0 is no channel"));
  EXPECT_THAT(reader_error(R"({"photon": true})"), HasSubstr("/source/photon: true is no channel"));
  EXPECT_THAT(reader_error(R"({"photon": ""})"), HasSubstr("/source/photon: \"\" is no channel"));
}

TEST(OptionReader, BoundsAreInclusiveAndNamed) {
  EXPECT_EQ(read(R"({"length_ms": 60000})").length_ms, 60000);
  EXPECT_EQ(reader_error(R"({"length_ms": 60001})"),
            "folder/a.json: /source/length_ms: 60001 is above 60000 ms, the most allowed");
  EXPECT_EQ(reader_error(R"({"length_ms": 0.25})"),
            "folder/a.json: /source/length_ms: 0.25 is below 0.5 ms, the least allowed");
  EXPECT_THAT(reader_error(R"({"start_s": -1})"), HasSubstr("/source/start_s: -1 is below 0"));
  EXPECT_EQ(read(R"({"count": -3})").count, -3);
  EXPECT_THAT(reader_error(R"({"count": -4})"), HasSubstr("/source/count: -4 is below -3"));
  EXPECT_THAT(reader_error(R"({"count": 9})"), HasSubstr("/source/count: 9 is above 8"));
  EXPECT_THAT(reader_error(R"({"times_s": [1, 10]})"),
              HasSubstr("/source/times_s/1: 10 is above 9 s, the most allowed"));
  EXPECT_THAT(reader_error(R"({"target": {"distance_m": 101}})"),
              HasSubstr("/source/target/distance_m: 101 is above 100"));
}

// JSON has none, and CSV has: within no bounds.
TEST(OptionReader, NotANumberIsRefused) {
  const nlohmann::json given = {{"start_s", std::nan("")}};
  OptionReader reader(given, "folder/a.json", "/source");
  EveryOption options;
  EXPECT_THAT(test::error_text([&] { options.describe(reader); }),
              HasSubstr("/source/start_s: null is below 0"));
}

TEST(OptionReader, AWholeNumberMayBeWrittenWithAnExponent) {
  EXPECT_EQ(read(R"({"count": 0.8e1})").count, 8);
  EXPECT_THAT(reader_error(R"({"count": 1.5})"),
              HasSubstr("/source/count: 1.5 is no whole number"));
  EXPECT_THAT(reader_error(R"({"count": 18446744073709551615})"), HasSubstr("is no whole number"));
  EXPECT_THAT(reader_error(R"({"count": "4"})"), HasSubstr("is no whole number"));
}

TEST(OptionReader, WholeNumbersAreExactToTheLastBit) {
  const auto json = json_value(R"({"a": 9223372036854775807, "b": 9007199254740993,
      "c": 9007199254740994.0})");
  OptionReader reader(json, "a.json", "");
  std::int64_t value = 0;
  reader.integer("a", value, 0, INT64_MAX, "");
  EXPECT_EQ(value, INT64_MAX);
  reader.integer("b", value, 0, INT64_MAX, "");
  EXPECT_EQ(value, 9007199254740993);
  EXPECT_THAT(test::error_text([&] { reader.integer("c", value, 0, INT64_MAX, ""); }),
              HasSubstr("/c: 9.007199254740994e+15 is no whole number"));
}

TEST(OptionReader, WholeNumbersBelowZeroAreExactToo) {
  const auto json = json_value(R"({"a": -9223372036854775808, "b": -9007199254740992.0,
      "c": -9007199254740994.0, "d": -1e300})");
  OptionReader reader(json, "a.json", "");
  std::int64_t value = 0;
  reader.integer("a", value, INT64_MIN, 0, "");
  EXPECT_EQ(value, INT64_MIN);
  reader.integer("b", value, INT64_MIN, 0, "");
  EXPECT_EQ(value, -9007199254740992);
  EXPECT_THAT(test::error_text([&] { reader.integer("c", value, INT64_MIN, 0, ""); }),
              HasSubstr("/c: -9.007199254740994e+15 is no whole number"));
  EXPECT_THAT(test::error_text([&] { reader.integer("d", value, INT64_MIN, 0, ""); }),
              HasSubstr("/d: -1e+300 is no whole number"));
}

TEST(OptionReader, WrongTypesAreNamed) {
  EXPECT_THAT(reader_error(R"({"length_ms": "50"})"),
              HasSubstr("/source/length_ms: \"50\" is no num"));
  EXPECT_THAT(reader_error(R"({"start_s": null})"),
              HasSubstr("/source/start_s: null is no number"));
  EXPECT_THAT(reader_error(R"({"live": 1})"),
              HasSubstr("/source/live: 1 is neither true nor false"));
  EXPECT_THAT(reader_error(R"({"name": 1})"), HasSubstr("/source/name: 1 is no text"));
  EXPECT_THAT(reader_error(R"({"times_s": 1})"), HasSubstr("/source/times_s: 1 is no array"));
  EXPECT_THAT(reader_error(R"({"target": 1})"), HasSubstr("/source/target: 1 is no object"));
  EXPECT_THAT(reader_error(R"({"targets": {}})"), HasSubstr("/source/targets: {} is no array"));
  EXPECT_THAT(reader_error("[]"), StartsWith("folder/a.json: /source: [] is no object"));
}

TEST(OptionReader, AChoiceNamesAllAndTheNearest) {
  EXPECT_EQ(reader_error(R"({"colour": "gren"})"),
            "folder/a.json: /source/colour: \"gren\" is none of red, green; did you mean green?");
  EXPECT_EQ(reader_error(R"({"colour": "xyzxyz"})"),
            "folder/a.json: /source/colour: \"xyzxyz\" is none of red, green");
  EXPECT_THAT(reader_error(R"({"colour": 1})"),
              HasSubstr("/source/colour: 1 is none of red, green"));
}

TEST(OptionReader, UnknownKeysNameTheNearest) {
  EXPECT_EQ(reader_error(R"({"lenght_ms": 50})"),
            "folder/a.json: /source/lenght_ms: is an unknown key; did you mean length_ms?");
  EXPECT_THAT(
      reader_error(R"({"targets": [{"distance_m": 1}, {"distance_m": 1, "distanc_m": 2}]})"),
      HasSubstr("/source/targets/1/distanc_m: is an unknown key"));
}

TEST(OptionReader, RequiredKeysHaveToBeThere) {
  EXPECT_EQ(reader_error(R"({"targets": [{}]})"),
            "folder/a.json: /source/targets/0/distance_m: is missing and has no default; add it");
}

TEST(OptionReader, ARequiredKeyWithASlipIsRecognised) {
  EXPECT_THAT(reader_error(R"({"targets": [{"distance_n": 1}]})"),
              HasSubstr("/source/targets/0/distance_m: is missing and has no default; "
                        "\"distance_n\" is an unknown key: did you mean distance_m?"));
}

TEST(OptionReader, LongKeysAndTextsAreCut) {
  const std::string many(1'000'000, 'k');
  const std::string key = reader_error(R"({"a\u001b\nsplid: error: )" + many + R"(": 1})");
  EXPECT_THAT(key, HasSubstr("folder/a.json: /source/a??splid: error: kkk"));
  EXPECT_THAT(key, HasSubstr("kkk...: is an unknown key; known are"));
  EXPECT_LT(key.size(), 1000U);
  const std::string text = reader_error(R"({"name": ")" + many + "\"}");
  EXPECT_THAT(text, HasSubstr("kkk... has 1000000 bytes; a text has at most 4096"));
  EXPECT_LT(text.size(), 1000U);
}

TEST(OptionReader, FaultsAreTheUsers) {
  try {
    read(R"({"count": 9})");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
  }
}

}  // namespace
}  // namespace splid
