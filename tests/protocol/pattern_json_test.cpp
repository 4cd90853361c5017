#include "protocol/pattern_json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/pattern_make.hpp"

namespace splid {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const char* const calibrated =
    R"({"schema":"splid.pattern","v":[1,0],"mode":"interleaved","unambiguous_delay_ps":1000,)"
    R"("subperiods_ps":[500,250],"segments":[{"period_ps":1000,)"
    R"("pulse_times_ps":[0,250.125,0.1e3,999.9999999999999],"amplitudes":[1,0.5,0,2],)"
    R"("repeats":0}],"calibrated_period_ps":1000.0000001,"pulse":{"shape":"tabulated",)"
    R"("first_ps":-12.5,"step_ps":0.5,"density":[0,1,0.25]},"calibration":{)"
    R"("recording":"still.ptu","seconds":8.5,"photons":9007199254740993,"signal_photons":1000000,)"
    R"("std_period_ps":1e-07,"std_pulse_times_ps":[0.5,0,1,2],"std_amplitudes":[0,0.01,0,0],)"
    R"("std_density":[0,0.1,0.2],"distance_m":-1.5}})";

std::string with(const std::string& from, const std::string& to) {
  std::string json = calibrated;
  json.replace(json.find("250.125,0.1e3"), 13, "100,250.125");
  const std::size_t at = json.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return json.replace(at, from.size(), to);
}

std::string good_json() { return with("0]", "0]"); }

std::string pattern_error(const std::string& json) {
  try {
    (void)pattern_from_json(json, "a.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::data);
    EXPECT_THAT(error.what(), testing::StartsWith("a.json: "));
    return error.what();
  }
  return "no error";
}

TEST(PatternJson, ReadsEveryMember) {
  const Pattern pattern = pattern_from_json(good_json(), "a.json");
  Pattern expected;
  expected.mode = Mode::interleaved;
  expected.unambiguous_delay_ps = 1'000;
  expected.subperiods_ps = {500, 250};
  expected.segments = {{1'000, {0, 100, 250.125, 999.9999999999999}, {1, 0.5, 0, 2}, 0}};
  expected.calibrated_period_ps = 1'000.0000001;
  expected.pulse = TabulatedPulse{-12.5, 0.5, {0, 1, 0.25}};
  expected.calibration = {
      "still.ptu",   8.5, 9'007'199'254'740'993, 1e6, 1e-7, {0.5, 0, 1, 2}, {0, 0.01, 0, 0},
      {0, 0.1, 0.2}, -1.5};
  EXPECT_EQ(pattern, expected);
}

TEST(PatternJson, WritesWhatItReads) {
  EXPECT_EQ(to_json(pattern_from_json(good_json(), "a.json")), good_json());
}

TEST(PatternJson, Minimal) {
  const std::string json =
      R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline","unambiguous_delay_ps":5,)"
      R"("segments":[{"period_ps":5,"pulse_times_ps":[0]}]})";
  EXPECT_EQ(pattern_from_json(json, "a.json"), make_periodic(Mode::baseline, 5));
  EXPECT_EQ(to_json(make_periodic(Mode::baseline, 5)),
            R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline","unambiguous_delay_ps":5,)"
            R"("segments":[{"period_ps":5,"pulse_times_ps":[0],"amplitudes":[1],"repeats":0}]})");
}

TEST(PatternJson, FileHasAMemberALine) {
  const Pattern pattern = make_mrr(std::vector<double>{4, 6}, std::vector<std::int64_t>{2, 1});
  EXPECT_EQ(to_json_file(pattern), R"({
  "schema": "splid.pattern",
  "v": [1, 0],
  "mode": "mrr",
  "unambiguous_delay_ps": 12,
  "subperiods_ps": [4, 6],
  "segments": [{"period_ps": 4, "pulse_times_ps": [0], "amplitudes": [1], "repeats": 2},
    {"period_ps": 6, "pulse_times_ps": [0], "amplitudes": [1], "repeats": 1}]
}
)");
}

TEST(PatternJson, TextsOfAFileStayAsTheyAre) {
  Pattern pattern = pattern_from_json(good_json(), "a.json");
  for (const char* name : {"a:b,{c}],d.ptu", R"(a\,"b:c",\)"}) {
    pattern.calibration->recording = name;
    EXPECT_EQ(pattern_from_json(to_json_file(pattern), "a.json"), pattern) << name;
  }
}

TEST(PatternJson, RoundTripIsExact) {
  const std::vector<Pattern> patterns = {
      make_periodic(Mode::ambiguous, 1e6 / 3, 7),
      make_interleaved(std::vector<double>{180'000, 189'000}), make_random({}),
      make_mrr(std::vector<double>{90'001, 94'500}, std::vector<std::int64_t>{5, 6})};
  for (const Pattern& pattern : patterns) {
    EXPECT_EQ(pattern_from_json(to_json(pattern), "a.json"), pattern);
    EXPECT_EQ(pattern_from_json(to_json_file(pattern), "a.json"), pattern);
  }
}

TEST(PatternJson, UnknownMembersNameTheNearest) {
  EXPECT_THAT(pattern_error(with("\"subperiods_ps\"", "\"subperiod_ps\"")),
              HasSubstr("/subperiod_ps: unknown member; did you mean subperiods_ps?"));
  EXPECT_THAT(pattern_error(with("\"repeats\"", "\"repeat\"")),
              HasSubstr("/segments/0/repeat: unknown member; did you mean repeats?"));
  EXPECT_THAT(pattern_error(with("\"density\"", "\"densities\"")),
              HasSubstr("/pulse/densities: unknown member; did you mean density?"));
  EXPECT_THAT(pattern_error(with("\"interleaved\"", "\"interleave\"")),
              HasSubstr("/mode: interleave is no mode; did you mean interleaved?"));
}

TEST(PatternJson, CalibrationsDistanceMayBeLeftOut) {
  const Pattern pattern = pattern_from_json(with(",\"distance_m\":-1.5", ""), "a.json");
  EXPECT_FALSE(pattern.calibration->distance_m);
  EXPECT_EQ(to_json(pattern), with(",\"distance_m\":-1.5", ""));
}

TEST(PatternJson, CalibrationsFaultsAreNamed) {
  EXPECT_THAT(pattern_error(with("\"seconds\"", "\"second\"")),
              HasSubstr("/calibration/second: unknown member; did you mean seconds?"));
  EXPECT_THAT(pattern_error(with("9007199254740993", "-1")),
              HasSubstr("/calibration/photons: -1; it must be at least 0"));
  EXPECT_THAT(pattern_error(with("[0.5,0,1,2]", "[0.5,0,1]")),
              HasSubstr("/calibration/std_pulse_times_ps: 3 values; there must be one a pulse, 4"));
  EXPECT_THAT(
      pattern_error(with("[0,0.01,0,0]", "[0,-0.01,0,0]")),
      HasSubstr("/calibration/std_amplitudes: a value negative or not finite; all must be"));
  EXPECT_THAT(pattern_error(with("[0,0.1,0.2]", "[]")),
              HasSubstr("/calibration/std_density: 0 values; there must be one a value of "
                        "/pulse/density, 3"));
}

TEST(PatternJson, OtherSchemasAndVersionsAreRefused) {
  EXPECT_THAT(pattern_error(with("splid.pattern", "splid.config")),
              HasSubstr("is a splid configuration, but a pattern file is expected"));
  EXPECT_THAT(pattern_error(with("[1,0]", "[2,0]")),
              HasSubstr("/v: [2,0]; this program reads version 1"));
  EXPECT_THAT(pattern_error(with("[1,0]", "[1]")), HasSubstr("/v: [1]; it must be [major,minor]"));
  EXPECT_THAT(pattern_error(with("[1,0]", "1")), HasSubstr("/v: 1; it must be an array"));
  EXPECT_EQ(pattern_error(with("[1,0]", "[1,9]")), "no error");
}

TEST(PatternJson, WrongTypesAreNamed) {
  EXPECT_THAT(pattern_error(with("250.125", "\"x\"")),
              HasSubstr("/segments/0/pulse_times_ps/2: \"x\"; it must be a number"));
  EXPECT_THAT(pattern_error(with("[500,250]", "500")),
              HasSubstr("/subperiods_ps: 500; it must be an array"));
  EXPECT_THAT(pattern_error(with("\"repeats\":0", "\"repeats\":0.5")),
              HasSubstr("/segments/0/repeats: 0.5; it must be a whole number"));
  EXPECT_THAT(pattern_error(with("\"repeats\":0", "\"repeats\":9223372036854775808")),
              HasSubstr("it must be a whole number"));
  EXPECT_THAT(pattern_error(with("\"interleaved\"", "3")),
              HasSubstr("/mode: 3; it must be a string"));
  EXPECT_THAT(pattern_error(with("\"tabulated\"", "\"gaussian\"")),
              HasSubstr("/pulse/shape: gaussian"));
  EXPECT_THAT(pattern_error("[]"), HasSubstr("it must be an object"));
  EXPECT_THAT(pattern_error(with("\"mode\":\"interleaved\",", "")), HasSubstr("/mode: missing"));
}

TEST(PatternJson, BrokenBoundsAreNamed) {
  Pattern many;
  many.mode = Mode::mrr;
  for (int k = 0; k < 256; ++k) {
    many.segments.push_back({1000.0 + k, {0}, {1}, 2});
    many.subperiods_ps.push_back(1000.0 + k);
  }
  EXPECT_THAT(validate(many).value_or(""), HasSubstr("/segments: 256 segments; there must be at"));
  EXPECT_THAT(pattern_error(with("250.125", "-1")),
              HasSubstr("/segments/0/pulse_times_ps/2: -1; "));
  EXPECT_THAT(pattern_error(with("\"amplitudes\":[1,", "\"amplitudes\":[")),
              HasSubstr("/segments/0/amplitudes: 3 amplitudes"));
}

TEST(PatternJson, WhatIsNoJsonNamesLineAndColumn) {
  EXPECT_THAT(pattern_error("{\n  \"schema\" 1}"),
              AllOf(HasSubstr("not JSON: parse error at line 2, column 12"),
                    Not(HasSubstr("json.exception"))));
  EXPECT_THAT(pattern_error(""), HasSubstr("not JSON"));
  EXPECT_THAT(pattern_error("\x8f\xff"), ::testing::EndsWith("last read: '?'"));
  EXPECT_THAT(pattern_error(with("250.125", "NaN")), HasSubstr("not JSON"));
  EXPECT_THAT(pattern_error(with("250.125", "1e999")), HasSubstr("too large for a double"));
  EXPECT_THAT(pattern_error(std::string(100'000, '[')), HasSubstr("nested too deeply"));
}

}  // namespace
}  // namespace splid
