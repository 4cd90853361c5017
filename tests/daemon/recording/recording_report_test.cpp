#include "daemon/recording/recording_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "protocol/ptu_encode.hpp"
#include "tests/support/made_recording.hpp"
#include "tests/support/other_recordings.hpp"
#include "tests/support/sync_stream.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::recording {
namespace {

using test::photon_record;
using test::SyncStream;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class RecordingReport : public ::testing::Test {
 protected:
  // A recording of these syncs, as sync records or of an input.
  std::string recording_of(const SyncStream& stream, int input, const std::string& config,
                           std::int64_t divider = 1) const {
    PtuFacts facts;
    facts.sync_divider = divider;
    facts.config_json = config;
    PtuEncoder encoder(0);
    std::vector<std::byte> records;
    for (const std::int64_t sync_ps : stream.make()) {
      const Tag tag = input < 0 ? sync_tag(sync_ps) : photon_tag(sync_ps, input);
      encoder.encode(std::span(&tag, 1), records);
    }
    encoder.flush(records);
    facts.record_count = encoder.records();
    std::vector<std::byte> bytes = make_ptu_header(facts);
    bytes.insert(bytes.end(), records.begin(), records.end());
    return folder.write("a.ptu", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  // The period and its deviation, as they are printed.
  static std::pair<double, double> printed_period(const std::string& report) {
    double period_ps = 0;
    double std_ps = 0;
    const std::size_t at = report.find("sync period");
    if (at == std::string::npos) return {};
    std::sscanf(report.c_str() + at, "sync period %lf ps +- %lf ps", &period_ps, &std_ps);
    return {period_ps, std_ps};
  }

  test::TempFolder folder;
};

// 512 gaps said 3,779,936.755 where the period was 3,780,007.56, with six decimals.
TEST_F(RecordingReport, ThePeriodOfDoubledSyncsIsRightToItsDeviation) {
  for (const double doubled : {0.0, 0.05, 0.3}) {
    SyncStream stream;
    stream.period_ps = 3'780'007.56;
    stream.end_ps = 300'000'000'000;
    stream.doubled = doubled;
    stream.double_after_ps = 20'000;
    stream.missing = 0.1;
    const auto [period_ps, std_ps] = printed_period(report_of(recording_of(stream, -1, "")));
    EXPECT_GT(std_ps, 0);
    EXPECT_LT(std_ps, 1e-3);
    EXPECT_NEAR(period_ps, stream.period_ps, 5 * std_ps) << doubled;
  }
}

// Half a million detections a second on two inputs, of which one is dead for 60 ns.
TEST_F(RecordingReport, TheDeadTimeOfEachInputIsSaid) {
  std::mt19937_64 random(1);
  std::vector<Tag> tags;
  for (std::int64_t at = 0; at < 100'000'000'000; at += 3'780'000) tags.push_back(sync_tag(at));
  for (const int input : {1, 2}) {
    std::exponential_distribution<double> wait_ps(1 / 2e6);
    for (double at = 0; at < 1e11; at += wait_ps(random) + (input == 2 ? 60'000 : 0)) {
      tags.push_back(photon_tag(std::llround(at), input));
    }
  }
  std::sort(tags.begin(), tags.end(),
            [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  PtuFacts facts;
  PtuEncoder encoder(0);
  std::vector<std::byte> records;
  encoder.encode(tags, records);
  encoder.flush(records);
  facts.record_count = encoder.records();
  std::vector<std::byte> bytes = make_ptu_header(facts);
  bytes.insert(bytes.end(), records.begin(), records.end());
  const std::string report =
      report_of(folder.write("a.ptu", {reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  EXPECT_THAT(report, HasSubstr("input 2        dead_time 6"));
  EXPECT_THAT(report, HasSubstr(" ns: Set detector.dead_time_ns to this time."));
  EXPECT_THAT(report, Not(HasSubstr("input 1        dead_time")));
  EXPECT_THAT(report, Not(HasSubstr("afterpulsing")));
}

TEST_F(RecordingReport, SyncsOnAnInputAreFoundWhereItsConfigurationNamesIt) {
  SyncStream stream;
  const std::string named =
      report_of(recording_of(stream, 5, R"({"channels":{"photon":[1],"sync":5}})"));
  EXPECT_NEAR(printed_period(named).first, stream.period_ps, 1e-3);
  EXPECT_THAT(named, HasSubstr("of input 5, which its configuration names"));
  for (const char* other : {"", "{}", R"({"channels":{"sync":"sync"}})", "no JSON"}) {
    EXPECT_THAT(report_of(recording_of(stream, 5, other)), Not(HasSubstr("sync period")));
  }
}

// One sync in eight, as a recorder's header may say of its sync input.
TEST_F(RecordingReport, ThePatternPeriodOfDividedSyncsIsSaid) {
  SyncStream stream;
  stream.period_ps = 30'240'000;
  const auto report = [&](std::int64_t divider, int input, const std::string& config) {
    return report_of(recording_of(stream, input, config, divider));
  };
  const std::string divided = report(8, -1, "");
  EXPECT_THAT(divided, HasSubstr("warning: one sync in 8 was recorded"));
  const std::string words =
      "(HWSync_Divider): the sync period is then 8 pattern periods, and a pattern period ";
  const std::size_t at = divided.find(words);
  ASSERT_NE(at, std::string::npos) << divided;
  EXPECT_NEAR(std::stod(divided.substr(at + words.size())), 3'780'000, 1e-3);
  EXPECT_THAT(report(1, -1, ""), Not(HasSubstr("HWSync_Divider")));
  EXPECT_THAT(report(8, 5, R"({"channels":{"sync":5}})"), Not(HasSubstr("HWSync_Divider")));
  const std::string old = folder.write("a.pt2", test::pico_harp_recording(2, {1U << 28U | 5U}));
  EXPECT_THAT(report_of(old),
              HasSubstr("(HWSync_Divider): the sync period is then 4 pattern periods\n"));
}

TEST_F(RecordingReport, TimesAtBothEndsOfTheRangeAreFarApart) {
  using Range = std::numeric_limits<std::int64_t>;
  const std::string file =
      folder.write("a.qutag", test::qutag_recording({{Range::min(), 1}, {Range::max(), 1}}));
  EXPECT_THAT(report_of(file), ContainsRegex("duration +9223372.04 s"));
}

TEST_F(RecordingReport, LossesAreSaidOfHeadersAndOfRecords) {
  PtuFacts facts = test::counted(1);
  facts.losses = {{500, 900, 7}, {3'000, 3'700, -1}};
  EXPECT_THAT(report_of(folder.write("a.ptu", test::recording(facts, {photon_record(1, 5)}))),
              HasSubstr("  losses                       2, 7 tags known; losses of an unknown "
                        "number of tags: 1\n"
                        "  first loss                 500 ps\n"
                        "  last loss                 3000 ps\n"
                        "  longest loss               700 ps\n"));
  folder.write("a.set", std::string(test::spc_settings));
  const auto spc = [&](std::uint32_t flag) {
    return report_of(folder.write(
        "a.spc", test::spc_recording(
                     100, {test::spc_photon(3, 4095, 2), flag | test::spc_photon(9, 4095, 2)})));
  };
  EXPECT_THAT(spc(test::spc_gap), AllOf(HasSubstr("losses                       1, 0 tags known; "),
                                        HasSubstr("longest loss             60000 ps")));
  EXPECT_THAT(spc(0), Not(HasSubstr("loss")));
}

TEST_F(RecordingReport, StepsBackAreSaidWhateverTheirSize) {
  const auto report = [&](std::initializer_list<std::uint32_t> records) {
    return report_of(folder.write("b.ptu", test::recording(test::counted(3), records)));
  };
  EXPECT_THAT(report({photon_record(1, 10), photon_record(1, 20), photon_record(1, 30)}),
              Not(HasSubstr("steps back")));
  EXPECT_THAT(report({photon_record(1, 10), photon_record(1, 30), photon_record(1, 20)}),
              AllOf(HasSubstr("steps back"), HasSubstr("by 10 ps at most"),
                    Not(HasSubstr("more than the 1 us"))));
  EXPECT_THAT(report({photon_record(1, 10), photon_record(1, 3'000'000), photon_record(1, 20)}),
              AllOf(HasSubstr("by 2,999,980 ps at most"), HasSubstr("1 by more than the 1 us"),
                    HasSubstr("the tagger's clock was set")));
}

TEST_F(RecordingReport, SaysWhatToDoNext) {
  const auto report = [&](std::initializer_list<std::uint32_t> records) {
    return recording::report_of(
        folder.write("c.ptu", test::recording(test::counted(records.size()), records)));
  };
  EXPECT_THAT(report({}), HasSubstr("next           nothing was detected"));
  EXPECT_THAT(report({photon_record(1, 10)}), HasSubstr("next           no sync records"));
  SyncStream stream;
  EXPECT_THAT(recording::report_of(recording_of(stream, -1, "")),
              HasSubstr("next           splid replay measures it"));
  EXPECT_THAT(recording::report_of(recording_of(stream, 5, R"({"channels":{"sync":5}})")),
              HasSubstr("next           splid replay measures it"));
}

}  // namespace
}  // namespace splid::recording
