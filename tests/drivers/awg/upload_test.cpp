#include "drivers/awg/upload.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "protocol/error.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/awg_double.hpp"
#include "tests/support/sanitized.hpp"

namespace splid::awg {
namespace {

using test::AwgDouble;
using test::AwgFaults;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::stop_token never;

void ignore(const char*, double) {}

Options options_for(const AwgDouble& awg) {
  Options options;
  options.address = awg.address();
  return options;
}

// Of all pulses in the pattern's period, from its segments.
std::vector<double> times_ps(const Pattern& pattern) {
  std::vector<double> times;
  double begin_ps = 0;
  for (const PatternSegment& segment : pattern.segments) {
    for (std::int64_t i = 0; i < std::max<std::int64_t>(segment.repeats, 1); ++i) {
      for (const double t : segment.pulse_times_ps) times.push_back(begin_ps + t);
      begin_ps += segment.period_ps;
    }
  }
  return times;
}

// Uploads, and compares what comes out with the pattern asked for and the one written back.
void check_played(const Pattern& pattern, AwgDouble& awg, const Options& options) {
  const Uploaded uploaded = upload(options, pattern, ignore, never);
  EXPECT_EQ(awg.errors(), 0U);
  const AwgDouble::Played played = awg.played(options.rest_v);
  const std::vector<double> asked_ps = times_ps(pattern);
  const std::vector<double> written_ps = times_ps(uploaded.played);
  const double period_ps = pattern_period_ps(pattern);
  ASSERT_GT(played.markers_ps.size(), 0U);
  EXPECT_NEAR(played.loop_ps, period_ps * static_cast<double>(played.markers_ps.size()),
              1e-9 * played.loop_ps);
  ASSERT_EQ(played.pulses_ps.size(), asked_ps.size() * played.markers_ps.size());
  for (std::size_t i = 0; i < played.pulses_ps.size(); ++i) {
    const std::size_t pulse = i % asked_ps.size();
    const double marker_ps = played.markers_ps[i / asked_ps.size()];
    const double time_ps = played.pulses_ps[i] - marker_ps;
    ASSERT_NEAR(time_ps, asked_ps[pulse], 0.5 * played.sample_ps + 1e-3) << i;
    // Several segments are written as they were asked for.
    const double off_ps = pattern.segments.size() == 1 ? 1e-3 : 0.5 * played.sample_ps + 1e-3;
    ASSERT_NEAR(time_ps, written_ps[pulse], off_ps) << i;
  }
}

TEST(AwgUpload, ThePulsesThatComeOutAreThoseAskedFor) {
  Pattern late = make_periodic(Mode::baseline, 3'780'000);
  late.segments[0].pulse_times_ps = {1'234'567.25};
  for (const Pattern& pattern :
       {make_interleaved(std::array{180e3, 189e3}), make_random({}),
        make_random({3'780'000, 40, 9'000, 7}),
        make_mrr(std::array{180e3, 189e3}, std::array<std::int64_t, 2>{13, 12}),
        make_mrr(std::array{100'100.0, 101'300.0}, std::array<std::int64_t, 2>{7, 9}),
        make_periodic(Mode::ambiguous, 3'780'000, 40), make_periodic(Mode::baseline, 100'000),
        late}) {
    SCOPED_TRACE(to_string(pattern.mode));
    AwgDouble awg;
    check_played(pattern, awg, options_for(awg));
  }
}

TEST(AwgUpload, OtherModelsPlayTheSame) {
  const Pattern mrr = make_mrr(std::array{180e3, 189e3}, std::array<std::int64_t, 2>{50, 50});
  AwgDouble extended;
  Options options = options_for(extended);
  options.model = 1;
  check_played(mrr, extended, options);
  for (const auto read_back : {AwgDouble::ReadBack::numbers, AwgDouble::ReadBack::block}) {
    AwgDouble m8190a(AwgDouble::Model::m8190a, {}, read_back);
    options = options_for(m8190a);
    options.model = 2;
    check_played(mrr, m8190a, options);
    for (int seed = 1; seed <= test::times(4); ++seed) {
      check_played(make_random({3'780'000, 40, 9'000, static_cast<std::uint64_t>(seed)}), m8190a,
                   options);
    }
    const Uploaded uploaded =
        upload(options, make_interleaved(std::array{180e3, 189e3}), ignore, never);
    EXPECT_THAT(uploaded.instrument, HasSubstr("M8190A"));
    const AwgDouble::Played played = m8190a.played(0);
    EXPECT_EQ(played.pulses_ps.size(), 40U);
    EXPECT_EQ(played.pulse_samples, 40 * 16);  // 2 ns at 8 GSa/s
  }
}

TEST(AwgUpload, LevelsAndWidthsAreThoseConfigured) {
  AwgDouble awg;
  Options options = options_for(awg);
  upload(options, make_random({}), ignore, never);
  EXPECT_NEAR(awg.farthest_v(0), -0.8, 1e-6);
  options.pulse_v = 0.9;
  options.rest_v = 0.1;
  options.pulse_width_ns = 3;
  upload(options, make_random({}), ignore, never);
  EXPECT_NEAR(awg.farthest_v(0.1), 0.9, 1e-6);
  const AwgDouble::Played played = awg.played(0.1);
  EXPECT_NEAR(static_cast<double>(played.pulse_samples) / 40 * played.sample_ps, 3'000,
              0.5 * played.sample_ps);
}

TEST(AwgUpload, OutputsAreOffUntilTheSamplesAreThere) {
  AwgDouble awg;
  upload(options_for(awg), make_random({}), ignore, never);
  const std::vector<std::string> heard = awg.heard();
  const auto place = [&](const std::string& line) {
    return std::find(heard.begin(), heard.end(), line) - heard.begin();
  };
  EXPECT_LT(place(":OUTP1 OFF"), place(":INST:DACM MARK"));
  EXPECT_LT(place(":TRAC1:DATA 1,0,"), place(":OUTP3 ON"));
  EXPECT_LT(place(":OUTP3 ON"), place(":OUTP1 ON"));
  EXPECT_LT(place(":OUTP1 ON"), place(":INIT:IMM"));
  EXPECT_EQ(heard.back(), ":SYST:ERR?");
}

TEST(AwgUpload, AnExternalReferenceIsAskedFor) {
  AwgDouble awg;
  Options options = options_for(awg);
  options.reference = ReferenceClock::external_10_mhz;
  upload(options, make_random({}), ignore, never);
  EXPECT_THAT(awg.heard(), ::testing::Contains(":ROSC:SOUR EXT;:ROSC:FREQ 1E7"));
}

TEST(AwgUpload, ARoundedRateIsInThePatternWrittenBack) {
  // 30.24 ppb below 64 GSa/s and so on: whole kHz.
  AwgDouble awg(AwgDouble::Model::m8195a, {}, AwgDouble::ReadBack::numbers, 7e3);
  const Pattern pattern = make_interleaved(std::array{180e3, 189e3});
  const Uploaded uploaded = upload(options_for(awg), pattern, ignore, never);
  const AwgDouble::Played played = awg.played(0);
  EXPECT_NE(uploaded.played.segments[0].period_ps, 3'780'000);
  EXPECT_NEAR(uploaded.played.segments[0].period_ps, played.loop_ps, 1e-6);
  EXPECT_NEAR(uploaded.played.segments[0].pulse_times_ps[39], played.pulses_ps[39], 1e-6);
}

TEST(AwgUpload, SaysHowFarItIs) {
  AwgDouble awg;
  std::vector<std::string> stages;
  std::vector<double> parts;
  upload(
      options_for(awg), make_random({}),
      [&](const char* what, double part) {
        if (stages.empty() || stages.back() != what) stages.emplace_back(what);
        parts.push_back(part);
      },
      never);
  EXPECT_THAT(stages, ::testing::ElementsAre("connecting", "sending", "comparing"));
  EXPECT_EQ(parts.back(), 1);
  EXPECT_THAT(parts, Each(AllOf(::testing::Ge(0), ::testing::Le(1))));
}

TEST(AwgUpload, StopEndsPlay) {
  AwgDouble awg;
  upload(options_for(awg), make_random({}), ignore, never);
  EXPECT_TRUE(awg.playing());
  EXPECT_THAT(switch_off(options_for(awg), never), HasSubstr("M8195A DE00000001"));
  EXPECT_FALSE(awg.playing());
  EXPECT_EQ(awg.errors(), 0U);
}

// A generator with a fault: what an upload says; it must not play.
std::string error_with(const AwgFaults& faults, Fault fault = Fault::device,
                       AwgDouble::Model model = AwgDouble::Model::m8195a) {
  AwgDouble awg(model, faults);
  Options options = options_for(awg);
  options.timeout_s = faults.silent_at.empty() ? 120 : 2;
  try {
    upload(options, make_random({}), ignore, never);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), fault);
    EXPECT_FALSE(awg.playing());
    EXPECT_THAT(error.what(), StartsWith("awg tcp:127.0.0.1:"));
    return error.what();
  }
  return "no error";
}

AwgFaults at(std::string AwgFaults::*what, const std::string& command) {
  AwgFaults faults;
  faults.*what = command;
  return faults;
}

TEST(AwgUpload, NamesWhatTheInstrumentSays) {
  EXPECT_THAT(error_with(at(&AwgFaults::error_at, ":ROSC:SOUR")),
              HasSubstr(":ROSC:SOUR INT: -241, Hardware missing; nothing there"));
  AwgFaults much = at(&AwgFaults::error_at, ":TRAC1:DATA 1,32256");
  much.error_code = -223;
  EXPECT_THAT(error_with(much), HasSubstr(":TRAC1:DATA 1,32256,: -223, "));
  EXPECT_THAT(error_with({}, Fault::device, AwgDouble::Model::m8190a),
              HasSubstr("*IDN?: answered \"Keysight Technologies,M8190A,DE00000001"));
  AwgFaults endless;
  endless.endless_errors = true;
  EXPECT_THAT(error_with(endless), HasSubstr("its error queue does not end: -350, Queue overflow"));
}

TEST(AwgUpload, NamesWhereTheInstrumentFallsSilent) {
  EXPECT_THAT(error_with(at(&AwgFaults::silent_at, "*IDN?")),
              HasSubstr(": *IDN?: not done after 2000 ms"));
  EXPECT_THAT(error_with(at(&AwgFaults::silent_at, ":TRAC1:DATA 1,64512")),
              HasSubstr(":TRAC1:DATA 1,64512,, then *OPC?: not done after 2000 ms"));
  EXPECT_THAT(error_with(at(&AwgFaults::silent_at, ":SYST:ERR?")),
              HasSubstr("*CLS, then :SYST:ERR?: not done after 2000 ms"));
  EXPECT_THAT(
      error_with(at(&AwgFaults::cut_at, ":TRAC1:DATA 1,32256")),
      AllOf(HasSubstr(", at :TRAC1:DATA 1,32256"),
            ::testing::AnyOf(HasSubstr("closed the connection"), HasSubstr("Connection reset"))));
  EXPECT_THAT(error_with(at(&AwgFaults::cut_at, ":SYST:ERR?")),
              ::testing::AnyOf(HasSubstr("closed the connection"), HasSubstr("Connection reset")));
}

// The error at the end comes when both outputs are on.
TEST(AwgUpload, OutputsAreOffWhateverGoesWrong) {
  using Model = AwgDouble::Model;
  for (const Model model : {Model::m8195a, Model::m8190a}) {
    for (const auto fault : {&AwgFaults::error_at, &AwgFaults::cut_at}) {
      AwgDouble awg(model, at(fault, ":INIT:IMM"));
      Options options = options_for(awg);
      if (model == Model::m8190a) options.model = 2;
      try {
        upload(options, make_random({}), ignore, never);
        ADD_FAILURE() << "no error";
      } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("; its outputs were switched off"));
      }
      EXPECT_FALSE(awg.any_output_is_on());
      EXPECT_EQ(awg.errors(), 0U);
    }
  }
}

TEST(AwgUpload, SaysWhereOutputsMayBeOn) {
  EXPECT_THAT(error_with(at(&AwgFaults::silent_at, ":INIT:IMM")),
              AllOf(HasSubstr(":INIT:IMM, then *OPC?: not done after"),
                    HasSubstr("whether its outputs are off is not known")));
  // Another instrument is told nothing.
  EXPECT_THAT(error_with({}, Fault::device, AwgDouble::Model::m8190a), Not(HasSubstr("outputs")));
}

TEST(AwgUpload, NamesAnswersThatAreNone) {
  EXPECT_THAT(error_with(at(&AwgFaults::garbage_at, "*IDN?")),
              HasSubstr("*IDN?: answered \"?#3?,?\"; awg.model is m8195a, which says M8195A"));
  EXPECT_THAT(error_with(at(&AwgFaults::garbage_at, "*OPC?")),
              HasSubstr("*OPC?: answered \"?#3?,?\", which is no number"));
  EXPECT_THAT(error_with(at(&AwgFaults::garbage_at, ":SYST:ERR?")),
              HasSubstr(":SYST:ERR?: answered \"?#3?,?\""));
  EXPECT_THAT(error_with(at(&AwgFaults::garbage_at, ":FREQ:RAST?")), HasSubstr("no number"));
  EXPECT_THAT(error_with(at(&AwgFaults::garbage_at, ":TRAC1:DATA?")),
              HasSubstr(":TRAC1:DATA? 1,0,32256: answered \"?#3?,?\", which are no samples"));
}

TEST(AwgUpload, NamesSettingsThatWereNotTaken) {
  EXPECT_THAT(error_with(at(&AwgFaults::ignored, ":FREQ:RAST ")),
              HasSubstr(":FREQ:RAST?: answered 0 Sa/s; "));
  EXPECT_THAT(error_with(at(&AwgFaults::ignored, ":VOLT1 ")),
              HasSubstr(":VOLT1?: answered \"+0.00000000000000E+00\" after :VOLT1 0.8"));
  EXPECT_THAT(error_with(at(&AwgFaults::ignored, ":TRAC1:DEF")),
              HasSubstr(":TRAC1:CAT?: answered \"0,0\" after :TRAC1:DEF 1,"));
  EXPECT_THAT(error_with(at(&AwgFaults::ignored, ":TRAC1:SEL 1")), HasSubstr(":TRAC1:SEL?"));
  AwgFaults wrong;
  wrong.wrong_sample = true;
  EXPECT_THAT(error_with(wrong), HasSubstr(":TRAC1:DATA? 1,0,32256: value 6 of the answer is not"));
  AwgFaults part;
  part.short_answers = true;
  EXPECT_THAT(error_with(part), HasSubstr("answered 32256 values; it was sent 64512"));
}

TEST(AwgUpload, WithoutReadBackSamplesAreNotCompared) {
  AwgFaults wrong;
  wrong.wrong_sample = true;
  AwgDouble awg(AwgDouble::Model::m8195a, wrong);
  Options options = options_for(awg);
  options.read_back = false;
  EXPECT_NO_THROW(upload(options, make_random({}), ignore, never));
  EXPECT_THAT(awg.heard(), Each(Not(StartsWith(":TRAC1:DATA?"))));
}

TEST(AwgUpload, SaysThatNobodyIsThere) {
  Options options;
  {
    const AwgDouble gone;
    options.address = gone.address();
  }
  const auto text_of = [&](Fault fault, const std::stop_token& stop) -> std::string {
    try {
      upload(options, make_random({}), ignore, stop);
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), fault);
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(text_of(Fault::device, never),
              HasSubstr("connect: Connection refused; is the generator on"));
  std::stop_source stopped;
  stopped.request_stop();
  const AwgDouble awg;
  options.address = awg.address();
  EXPECT_THAT(text_of(Fault::usage, stopped.get_token()), HasSubstr(": stopped; upload again"));
  options.address = "";
  EXPECT_THAT(text_of(Fault::usage, never), HasSubstr("awg/address: is missing"));
}

TEST(AwgUpload, CanBeStoppedMidway) {
  AwgDouble awg;
  std::stop_source stop;
  const auto stop_at_half = [&](const char*, double part) {
    if (part > 0.5) stop.request_stop();
  };
  EXPECT_THROW(upload(options_for(awg), make_random({}), stop_at_half, stop.get_token()), Error);
  EXPECT_FALSE(awg.playing());
  EXPECT_EQ(awg.heard().back(), ":SYST:ERR?");
  EXPECT_THAT(awg.heard(), ::testing::Contains(":OUTP3 OFF"));
}

TEST(AwgUpload, APatternThatCannotBePlayedReachesNobody) {
  AwgDouble awg;
  EXPECT_THROW(upload(options_for(awg), make_periodic(Mode::baseline, 1e7), ignore, never), Error);
  EXPECT_TRUE(awg.heard().empty());
}

}  // namespace
}  // namespace splid::awg
