#include "drivers/picoquant/source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/eventually.hpp"
#include "tests/support/picoquant_instrument.hpp"
#include "tests/support/shared_sink.hpp"

namespace splid::picoquant {
namespace {

using test::PicoQuantControl;
using test::PicoQuantEvent;
using test::PicoQuantInstrument;
using test::PicoQuantKind;
using testing::ElementsAre;
using testing::HasSubstr;

// A source on its own thread, stopped when it goes out of scope.
class RunningSource {
 public:
  explicit RunningSource(Options options) {
    SourceContext context;
    context.report = [this](const DeviceReport& report) { reports.add(report); };
    source_.emplace(std::move(options), context);
    thread_ = std::jthread([this](const std::stop_token& stop) { source_->run(sink, stop); });
  }
  ~RunningSource() { thread_ = {}; }
  RunningSource(const RunningSource&) = delete;
  RunningSource& operator=(const RunningSource&) = delete;

  [[nodiscard]] std::string overdue_call() const { return source_->overdue_call(); }
  // Whether a report with that caution comes.
  bool cautions(const std::string& words) {
    return test::eventually([&] {
      const auto all = reports.all();
      return std::any_of(all.begin(), all.end(), [&](const DeviceReport& each) {
        return each.caution.find(words) != std::string::npos;
      });
    });
  }

  test::SharedSink sink;
  test::ReportList reports;

 private:
  std::optional<Source> source_;
  std::jthread thread_;
};

Options options_of(const PicoQuantKind& kind) {
  Options options;
  const auto index = static_cast<std::uint8_t>(&kind - test::picoquant_kinds.data());
  options.family = static_cast<Family>(index);
  options.library = kind.library;
  return options;
}

class EachFamily : public ::testing::TestWithParam<int> {
 protected:
  [[nodiscard]] static const PicoQuantKind& kind() {
    return test::picoquant_kinds.at(static_cast<std::size_t>(GetParam()));
  }
  PicoQuantInstrument instrument{kind()};
  Options options = options_of(kind());
};

// Two wraps of the clock lie between the last two.
TEST_P(EachFamily, RecordsBecomeTags) {
  const auto step_ps = static_cast<std::int64_t>(kind().resolution_ps);
  const std::uint64_t wrap = test::picoquant_wrap(kind().is_picoharp);
  instrument.give(test::picoquant_records({{160, 0}, {320, 1}, {480, -5}, {2 * wrap + 160, 1}},
                                          kind().is_picoharp));
  RunningSource source(options);
  const auto last_ps = static_cast<std::int64_t>(2 * wrap + 160) * step_ps;
  const auto tags = source.sink.wait(5);
  EXPECT_THAT(std::vector(tags.begin(), tags.begin() + 5),
              ElementsAre(sync_tag(160 * step_ps), photon_tag(320 * step_ps, 1),
                          marker_tag(480 * step_ps, 5), photon_tag(last_ps, 1),
                          heartbeat_tag(static_cast<std::int64_t>(3 * wrap) * step_ps)));
  EXPECT_TRUE(source.reports.wait(DeviceState::connected, ""));
}

TEST_P(EachFamily, ShortReadsLoseNothing) {
  std::vector<PicoQuantEvent> events;
  for (std::uint64_t i = 0; i < 500; ++i) events.push_back({i * 1000, 1});
  instrument.give(test::picoquant_records(events, kind().is_picoharp));
  instrument.control().most_a_read = 7;
  RunningSource source(options);
  auto tags = source.sink.wait(events.size() + 1);
  std::erase_if(tags, [](const Tag& tag) { return tag.kind == TagKind::heartbeat; });
  ASSERT_EQ(tags.size(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    const double time_ps = static_cast<double>(events[i].ticks) * kind().resolution_ps;
    ASSERT_EQ(tags[i], photon_tag(static_cast<std::int64_t>(time_ps), 1)) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(All, EachFamily, ::testing::Range(0, 4), [](const auto& family) {
  return std::string(family_names.at(static_cast<std::size_t>(family.param)));
});

class PicoQuant : public ::testing::Test {
 protected:
  // The calls until a measurement begins.
  std::string settings_of(const PicoQuantKind& kind, const Options& options,
                          const std::string& model = "") {
    PicoQuantInstrument instrument(kind);
    if (!model.empty()) PicoQuantInstrument::text(instrument.control().model, model);
    const RunningSource source(options);
    EXPECT_TRUE(test::eventually([&] { return instrument.control().starts > 0; }));
    return instrument.log();
  }
};

TEST_F(PicoQuant, AMultiHarpIsSetAsConfigured) {
  const PicoQuantKind& kind = test::picoquant_kinds[0];
  Options options = options_of(kind);
  options.reference = Reference::external_10_mhz;
  options.sync_divider = 4;
  options.sync = {-200, Edge::falling, 10, 1500};
  options.inputs = {{1, {120, Edge::rising, 10, -300}}, {3, {}}};
  options.markers = {{2, Edge::falling}, {4, Edge::rising}};
  EXPECT_EQ(settings_of(kind, options),
            "Initialize 2 1\nSetSyncDiv 4\nSetSyncEdgeTrg -200 0\nSetSyncChannelOffset 1500\n"
            "SetInputEdgeTrg 0 120 1\nSetInputChannelOffset 0 -300\n"
            "SetInputEdgeTrg 2 -50 0\nSetInputChannelOffset 2 0\n"
            "SetInputChannelEnable 0 1\nSetInputChannelEnable 1 0\n"
            "SetInputChannelEnable 2 1\nSetInputChannelEnable 3 0\n"
            "SetMarkerEdges 1 0 1 1\nSetMarkerEnable 0 1 0 1\nSetOflCompression 0\n"
            "StartMeas 360000000\n");
}

TEST_F(PicoQuant, AHydraHarpHasDiscriminators) {
  const PicoQuantKind& kind = test::picoquant_kinds[1];
  Options options = options_of(kind);
  options.sync.level_mv = -120;
  options.inputs = {{2, {-80, Edge::falling, 5, 100}}};
  EXPECT_EQ(settings_of(kind, options),
            "Initialize 2 0\nCalibrate\nSetSyncDiv 1\nSetSyncCFD 120 10\nSetSyncChannelOffset 0\n"
            "SetInputCFD 1 80 5\nSetInputChannelOffset 1 100\n"
            "SetInputChannelEnable 0 0\nSetInputChannelEnable 1 1\n"
            "SetInputChannelEnable 2 0\nSetInputChannelEnable 3 0\n"
            "SetMarkerEdges 1 1 1 1\nSetMarkerEnable 0 0 0 0\nStartMeas 360000000\n");
}

TEST_F(PicoQuant, ATimeHarpHasEitherByItsModel) {
  const PicoQuantKind& kind = test::picoquant_kinds[2];
  const Options options = options_of(kind);
  EXPECT_THAT(settings_of(kind, options),
              HasSubstr("Initialize 2\nSetSyncDiv 1\nSetSyncCFD -50 -10\nSetSyncChannelOffset 0\n"
                        "SetInputCFD 0 -50 -10\n"));
  EXPECT_THAT(settings_of(kind, options, "TimeHarp 260 N"),
              HasSubstr("SetSyncDiv 1\nSetSyncEdgeTrg -50 0\nSetSyncChannelOffset 0\n"
                        "SetInputEdgeTrg 0 -50 0\n"));
}

TEST_F(PicoQuant, APicoHarpsSyncIsItsInputZero) {
  const PicoQuantKind& kind = test::picoquant_kinds[3];
  Options options = options_of(kind);
  options.sync.offset_ps = 700;
  EXPECT_EQ(settings_of(kind, options),
            "Initialize 2\nCalibrate\nSetSyncDiv 1\nSetInputCFD 0 50 10\nSetSyncOffset 700\n"
            "SetInputCFD 1 50 10\nSetMarkerEdges 1 1 1 1\nSetMarkerEnable 0 0 0 0\n"
            "StartMeas 360000000\n");
}

class PicoQuantFault : public ::testing::Test {
 protected:
  // Waits until tags of a whole measurement came, and returns all that came.
  std::vector<Tag> tags_after(RunningSource& source, std::uint64_t records) {
    EXPECT_TRUE(test::eventually([&] { return instrument.control().records >= records; }));
    return source.sink.wait(1);
  }
  bool said(RunningSource& source, DeviceState state, const std::string& words) {
    return source.reports.wait(state, words);
  }

  PicoQuantInstrument instrument{test::picoquant_kinds[0]};
  Options options = options_of(test::picoquant_kinds[0]);
};

// The tags of kinds that tell of a loss or a clock, and how many events came before each.
std::vector<std::pair<Tag, std::size_t>> signs_in(const std::vector<Tag>& tags) {
  std::vector<std::pair<Tag, std::size_t>> signs;
  std::size_t events = 0;
  for (const Tag& tag : tags) {
    if (is_event(tag.kind)) ++events;
    if (tag.kind > TagKind::heartbeat) signs.emplace_back(tag, events);
  }
  return signs;
}

// A loss from the last tag that came, and a clock that ends there. A new measurement begins at 0.
void expect_begun_anew(const std::vector<Tag>& tags) {
  const auto signs = signs_in(tags);
  ASSERT_EQ(signs.size(), 3U);
  const std::int64_t at_ps = signs[0].first.time_ps;
  EXPECT_EQ(signs[0].first, (Tag{at_ps, 0, TagKind::loss_begin, {}}));
  EXPECT_EQ(signs[1].first, (Tag{at_ps, -1, TagKind::loss_end, {}}));
  EXPECT_EQ(signs[2].first, (Tag{at_ps, 0, TagKind::clock_break, {}}));
  std::int64_t latest_ps = 0;
  std::size_t place = 0;
  for (; tags[place].kind <= TagKind::heartbeat; ++place) {
    latest_ps = std::max(latest_ps, tags[place].time_ps);
  }
  EXPECT_EQ(latest_ps, at_ps);
  ASSERT_LT(place + 3, tags.size());
  EXPECT_EQ(tags[place + 3], sync_tag(0));
}

// Makes the fault, and waits for its report and for tags after it.
void expect_new_measurement(PicoQuantInstrument& instrument, const Options& options,
                            std::atomic<std::int32_t> PicoQuantControl::*fault,
                            const std::string& words) {
  instrument.give_scene();
  RunningSource source(options);
  (void)source.sink.wait(1000);
  instrument.control().*fault = 1;
  EXPECT_TRUE(source.reports.wait(DeviceState::connected, words));
  EXPECT_TRUE(source.reports.wait(DeviceState::connected, "; its clock begins anew"));
  ASSERT_TRUE(test::eventually([&] { return instrument.control().starts == 2; }));
  std::vector<Tag> tags;
  ASSERT_TRUE(test::eventually([&] {
    tags = source.sink.wait(1);
    return is_event(tags.back().kind) || tags.back().kind == TagKind::heartbeat;
  }));
  expect_begun_anew(tags);
}

TEST_F(PicoQuantFault, AFullFifoIsALossFromTheLastTagOn) {
  expect_new_measurement(instrument, options, &PicoQuantControl::fifo_is_full,
                         "MultiHarp 150 1045678: its FIFO was full: more events than USB and this "
                         "machine take");
}

TEST_F(PicoQuantFault, WordsThatAreNoRecordsBeginAMeasurementAnew) {
  expect_new_measurement(instrument, options, &PicoQuantControl::garbage_reads,
                         "it sent data that are not T2 records");
}

TEST_F(PicoQuantFault, TheEndOfTheLongestMeasurementBeginsAnother) {
  expect_new_measurement(instrument, options, &PicoQuantControl::measurement_ends,
                         "its longest measurement is over");
}

TEST_F(PicoQuantFault, DroppedCountsAreALossBetweenTwoReads) {
  instrument.give_scene();
  RunningSource source(options);
  (void)source.sink.wait(1000);
  instrument.control().flags = 0x0040;
  EXPECT_TRUE(source.cautions("MultiHarp 150 1045678: its inputs drop counts"));
  instrument.control().flags = 0;
  std::vector<std::pair<Tag, std::size_t>> signs;
  ASSERT_TRUE(test::eventually([&] {
    signs = signs_in(source.sink.wait(1));
    return signs.size() == 2;
  }));
  EXPECT_EQ(signs[0].first.kind, TagKind::loss_begin);
  EXPECT_EQ(signs[1].first.kind, TagKind::loss_end);
  EXPECT_EQ(signs[1].first.value, -1);
  EXPECT_LT(signs[0].first.time_ps, signs[1].first.time_ps);
  EXPECT_EQ(instrument.control().starts, 1U);
}

TEST_F(PicoQuantFault, FlagsAndWarningsAreItsCaution) {
  instrument.give_scene();
  instrument.control().flags = 0x0008;
  instrument.control().warnings = 0x0041;
  RunningSource source(options);
  EXPECT_TRUE(source.cautions("it has lost its reference clock"));
  EXPECT_TRUE(source.cautions("; Sync rate is zero; An input rate is too high"));
  instrument.control().flags = 0;
  instrument.control().warnings = 0;
  EXPECT_TRUE(test::eventually([&] { return source.reports.all().back().caution.empty(); }));
}

// The stream stays with the instrument that it began with.
TEST_F(PicoQuantFault, UnpluggedAndPluggedInAgain) {
  instrument.give_scene();
  RunningSource source(options);
  (void)source.sink.wait(1000);
  instrument.plug("");
  EXPECT_TRUE(said(source, DeviceState::no_device,
                   "MultiHarp 1045678: MH_ReadFiFo: USB_BULKRD_FAIL (-37): it was unplugged or "
                   "switched off"));
  EXPECT_TRUE(said(source, DeviceState::no_device, "no MultiHarp 1045678 is plugged in"));
  instrument.plug("1099999");
  EXPECT_TRUE(said(source, DeviceState::no_device,
                   "no MultiHarp 1045678 is plugged in; there is 1099999: name it as /serial"));
  instrument.plug("1045678", 3);
  ASSERT_TRUE(test::eventually([&] { return instrument.control().starts == 2; }));
  EXPECT_TRUE(test::eventually(
      [&] { return source.reports.all().back().state == DeviceState::connected; }));
}

TEST_F(PicoQuantFault, OnlyTheInstrumentOfTheSerialNumberIsRead) {
  instrument.give_scene();
  instrument.plug("1000001", 0);
  instrument.plug("1000002", 1);
  options.serial = "1000003";
  RunningSource source(options);
  EXPECT_TRUE(said(source, DeviceState::no_device,
                   "no MultiHarp 1000003 is plugged in; there is 1000001, 1000002"));
  EXPECT_EQ(instrument.log(), "CloseDevice 0\nCloseDevice 1\n");
  instrument.plug("1000003", 2);
  EXPECT_TRUE(said(source, DeviceState::connected, ""));
}

TEST_F(PicoQuantFault, OneThatAnotherProgramUsesIsWaitedFor) {
  instrument.give_scene();
  instrument.control().open_code = -2;
  RunningSource source(options);
  EXPECT_TRUE(said(source, DeviceState::no_device,
                   "a MultiHarp is in use (MH_OpenDevice: DEVICE_BUSY (-2)): end the other"));
  instrument.control().open_code = 0;
  EXPECT_TRUE(said(source, DeviceState::connected, ""));
}

// Version 3.0 cannot switch off the compression of overflows.
TEST_F(PicoQuantFault, ALibraryOfAnotherVersionIsNotUsed) {
  PicoQuantInstrument::text(instrument.control().library_version, "3.0");
  RunningSource source(options);
  EXPECT_TRUE(said(source, DeviceState::failing,
                   "libmhlib.so is version 3.0; splid knows version 3.1 or 4.x: install such"));
  PicoQuantInstrument::text(instrument.control().library_version, "4.0");
  EXPECT_TRUE(said(source, DeviceState::connected, ""));
}

TEST_F(PicoQuantFault, ALibraryThatIsNotThereIsSaid) {
  options.library = "/nowhere/libmhlib.so";
  RunningSource source(options);
  EXPECT_TRUE(said(source, DeviceState::failing, "/nowhere/libmhlib.so: cannot open shared"));
  EXPECT_TRUE(said(source, DeviceState::failing, "name its file as /library"));
}

TEST_F(PicoQuantFault, ALibraryOfAnotherFamilyIsNone) {
  options.library = test::picoquant_kinds[1].library;
  RunningSource source(options);
  EXPECT_TRUE(said(source, DeviceState::failing, "libhhlib.so has no MH_GetErrorString"));
}

TEST_F(PicoQuantFault, WhatTheLibraryRefusesIsSaidInItsWords) {
  instrument.control().failing_code = -17;
  RunningSource source(options);
  EXPECT_TRUE(
      said(source, DeviceState::failing, "MultiHarp: MH_Initialize: INVALID_ARGUMENT (-17)"));
  EXPECT_THAT(instrument.log(), HasSubstr("Initialize 2 0\nCloseDevice 0\n"));
}

TEST_F(PicoQuantFault, AnInputThatItDoesNotHaveIsSaid) {
  options.inputs = {{7, {}}};
  RunningSource source(options);
  EXPECT_TRUE(
      said(source, DeviceState::failing, "MultiHarp: it has inputs 1 to 4, and /inputs names 7"));
}

TEST_F(PicoQuantFault, OneThatSendsNothingIsOpenedAnew) {
  instrument.give_scene();
  RunningSource source(options);
  (void)source.sink.wait(1000);
  instrument.control().is_silent = 1;
  EXPECT_TRUE(said(source, DeviceState::failing, "it sends nothing, not even the wraps"));
  EXPECT_TRUE(test::eventually([&] {
    return instrument.log().find("CloseDevice 0\nInitialize 2 0\n") != std::string::npos;
  }));
  instrument.control().is_silent = 0;
  EXPECT_TRUE(test::eventually(
      [&] { return source.reports.all().back().state == DeviceState::connected; }));
}

TEST_F(PicoQuantFault, ACallThatHangsIsNamed) {
  instrument.give_scene();
  RunningSource source(options);
  (void)source.sink.wait(1000);
  EXPECT_EQ(source.overdue_call(), "");
  instrument.control().hangs = 1;
  EXPECT_TRUE(test::eventually([&] { return source.overdue_call() == "MH_ReadFiFo"; }));
  instrument.control().hangs = 0;
  EXPECT_TRUE(test::eventually([&] { return source.overdue_call().empty(); }));
}

std::string fault_of(const Options& options) {
  const auto fault = options.validate();
  return fault ? fault->pointer + ": " + fault->what : "none";
}

TEST(PicoQuantOptions, MustFitTheFamily) {
  Options options;
  options.family = Family::hydraharp;
  EXPECT_EQ(fault_of(options), "none");
  options.inputs[0].trigger.edge = Edge::rising;
  EXPECT_EQ(fault_of(options),
            "/inputs/0/edge: \"rising\": a HydraHarp 400 takes falling edges alone");
  options.inputs[0].trigger = {20, Edge::falling, 10, 0};
  EXPECT_EQ(fault_of(options), "/inputs/0/level_mv: 20: a HydraHarp 400 takes -1000 to 0 mV");
  options = {};
  options.family = Family::picoharp300;
  EXPECT_EQ(fault_of(options), "none");
  options.sync_divider = 16;
  EXPECT_EQ(fault_of(options), "/sync/divider: 16: a PicoHarp 300 divides by 8 at most");
  options.sync_divider = 8;
  options.sync.zero_cross_mv = 21;
  EXPECT_EQ(fault_of(options), "/sync/zero_cross_mv: 21: a PicoHarp 300 takes 0 to 20 mV");
  options.sync = {};
  options.inputs[0].input = 2;
  EXPECT_EQ(fault_of(options), "/inputs/0/input: 2: a PicoHarp 300 has input 1 and the sync (0)");
  options.inputs[0] = {1, {-50, Edge::falling, 10, 5}};
  EXPECT_THAT(fault_of(options), HasSubstr("/inputs/0/offset_ps: a PicoHarp 300 delays its sync"));
  options.inputs = {InputOptions{}};
  options.reference = Reference::external_10_mhz;
  EXPECT_THAT(fault_of(options), HasSubstr("/reference: \"external_10_mhz\": a PicoHarp 300 has"));
}

TEST(PicoQuantOptions, NameEachInputAndMarkerOnce) {
  Options options;
  options.inputs = {{1, {}}, {2, {}}, {1, {}}};
  EXPECT_EQ(fault_of(options), "/inputs/2/input: 1 is there already");
  options.inputs = {InputOptions{}};
  options.markers = {{3, Edge::rising}, {3, Edge::falling}};
  EXPECT_EQ(fault_of(options), "/markers/1/marker: 3 is there already");
}

}  // namespace
}  // namespace splid::picoquant
