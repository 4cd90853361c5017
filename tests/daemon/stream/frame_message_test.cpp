#include "daemon/stream/frame_message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "estimator/checks/finding.hpp"
#include "protocol/frame_columns.hpp"

namespace splid {
namespace {

constexpr double half_c_m_per_ns = 0.149896229;

FrameCapacity small() { return {1000, 100, 10, 10}; }

class FrameMessages : public testing::Test {
 protected:
  FrameMessages() {
    context.mode = Mode::interleaved;
    context.range_offset_m = 10;
    context.min_seen_fraction = 0.9;
    context.period_ps = 3'780'000;
    context.amplitude_per_period = 40;
    frame.sequence = 7;
    frame.start_ps = 1'000;
    frame.end_ps = 50'000'001'000;
    frame.seen_fraction = 1;
    frame.sync.locked = true;
    frame.sync.period_ps = 3'780'010;
    frame.sync.count = 13'227;
    for (int i = 0; i < 500; ++i) frame.photons_ps.push(i);
    estimate.status = FrameStatus::ok;
    estimate.has_values = true;
    estimate.delay_ns = 2000;
    estimate.delay_start_ns = 1999;
    estimate.velocity_mps = -3;
    estimate.signal_per_pulse = 1e-3;
    estimate.background_per_ns = 1e-4;
    estimate.std_delay_ns = 0.01;
    estimate.std_velocity_mps = 0.04;
    estimate.std_background_per_ns = 1e-6;
    estimate.significance_nats = 900;
    estimate.range_odds_nats = 450;
  }

  [[nodiscard]] FrameMessage make() const {
    return make_frame_message(frame, estimate, context, {12.5, 2, 3});
  }

  FrameContext context;
  Frame frame{small()};
  Estimate estimate;
};

TEST_F(FrameMessages, TurnTheEstimateIntoPublishedUnits) {
  const FrameMessage message = make();
  EXPECT_EQ(message.status, FrameStatus::ok);
  EXPECT_TRUE(message.valid());
  EXPECT_EQ(message.sequence, 7u);
  EXPECT_EQ(message.timestamp_s, 12.5);
  EXPECT_EQ(message.start_ps, 1'000);
  EXPECT_EQ(message.duration_ms, 50);
  EXPECT_DOUBLE_EQ(message.distance_m.value(), half_c_m_per_ns * 2000 - 10);
  EXPECT_DOUBLE_EQ(message.std_distance_m.value(), half_c_m_per_ns * 0.01);
  EXPECT_EQ(message.velocity_mps, -3);
  EXPECT_EQ(message.delay_ns, 1999);
  EXPECT_DOUBLE_EQ(message.background_per_s.value(), 1e5);
  EXPECT_DOUBLE_EQ(message.std_background_per_s.value(), 1e3);
  EXPECT_DOUBLE_EQ(message.signal_per_period.value(), 0.04);
  EXPECT_DOUBLE_EQ(message.background_per_period.value(), 0.378001);
  EXPECT_DOUBLE_EQ(message.sbr.value(), 0.04 / 0.378001);
  EXPECT_EQ(message.photons, 500u);
  EXPECT_EQ(message.latency_ms, 3);
  EXPECT_EQ(message.sync->period_ps, 3'780'010);
}

TEST_F(FrameMessages, SayThePulsesWidthWhereItWasFitted) {
  EXPECT_EQ(make().pulse_sigma_ps, std::nullopt);
  EXPECT_EQ(make().std_pulse_sigma_ps, std::nullopt);
  estimate.pulse_sigma_ns = 0.125;
  estimate.std_pulse_sigma_ns = 0.0078125;
  EXPECT_DOUBLE_EQ(make().pulse_sigma_ps.value(), 125);
  EXPECT_DOUBLE_EQ(make().std_pulse_sigma_ps.value(), 7.8125);
}

// With the unit and the advice of the estimator's table.
TEST_F(FrameMessages, HaveTheFindingsOfTheEstimate) {
  EXPECT_TRUE(make().findings.empty());
  estimate.findings.add({FindingName::vibration, 0.5, 0.0625, 41});
  estimate.findings.add({FindingName::fading, 0.25, 0.125, 14});
  const FrameMessage message = make();
  ASSERT_EQ(message.findings.size(), 2U);
  EXPECT_EQ(message.findings[0],
            (FrameMessage::Finding{"vibration", 0.5, 0.0625, "mm", 41,
                                   checks::row_of(FindingName::vibration).advice}));
  EXPECT_EQ(message.findings[1].name, "fading");
  EXPECT_EQ(message.findings[1].unit, "");
  EXPECT_EQ(pattern_finding(message), nullptr);
}

TEST_F(FrameMessages, ContradictThePatternWithoutATargetOnly) {
  estimate.findings.add({FindingName::wrong_pattern, 1, 0, 900});
  EXPECT_EQ(pattern_finding(make()), nullptr);
  estimate.status = FrameStatus::no_target;
  const FrameMessage message = make();
  ASSERT_NE(pattern_finding(message), nullptr);
  EXPECT_EQ(pattern_finding(message)->advice, checks::row_of(FindingName::wrong_pattern).advice);
}

// A row of a table has room for every name at once.
TEST(FindingNames, AllFitTheColumn) {
  FrameMessage message;
  FoundList all;
  for (std::size_t i = 0; i < finding_names; ++i) all.add({static_cast<FindingName>(i), 1, 1, 1});
  message.findings = to_message(all);
  std::string names;
  for (const auto& finding : message.findings) names += finding.name + ";";
  names.pop_back();
  EXPECT_THAT(frame_csv_row(message), testing::HasSubstr("," + names + ","));
  std::string row;
  append_frame_row(message, row);
  EXPECT_THAT(row, testing::HasSubstr(names));
}

TEST_F(FrameMessages, ListTheirTargetsWhereThereMayBeSeveral) {
  EXPECT_FALSE(make().targets);
  context.lists_targets = true;
  ASSERT_EQ(make().targets->size(), 1u);
  EXPECT_EQ(make().targets->front().distance_m, make().distance_m);
  EXPECT_EQ(make().targets->front().significance, 900);
  estimate.target_count = 2;
  estimate.targets[0] = estimate.first_target();
  estimate.targets[1] = estimate.first_target();
  estimate.targets[1].status = FrameStatus::ambiguous;
  estimate.targets[1].delay_ns = 2100;
  estimate.targets[1].std_delay_ns = 0.02;
  estimate.targets[1].findings.add({FindingName::jerk, 700, 20, 30});
  estimate.targets[1].signal_per_pulse = 5e-4;
  estimate.targets[1].std_velocity_mps = 0;
  const FrameMessage message = make();
  ASSERT_EQ(message.targets->size(), 2u);
  const FrameMessage::Target& second = message.targets->at(1);
  EXPECT_EQ(second.status, FrameStatus::ambiguous);
  EXPECT_DOUBLE_EQ(second.distance_m.value(), half_c_m_per_ns * 2100 - 10);
  EXPECT_DOUBLE_EQ(second.std_distance_m.value(), half_c_m_per_ns * 0.02);
  EXPECT_FALSE(second.std_velocity_mps);
  EXPECT_DOUBLE_EQ(second.signal_per_period.value(), 0.02);
  ASSERT_EQ(second.findings.size(), 1U);
  EXPECT_EQ(second.findings[0].name, "jerk");
  EXPECT_EQ(second.findings[0].unit, "m/s3");
  EXPECT_TRUE(message.targets->front().findings.empty());
  estimate.status = FrameStatus::no_target;
  estimate.has_values = false;
  EXPECT_TRUE(make().targets->empty());
}

TEST_F(FrameMessages, AreIncompleteBelowTheSeenFraction) {
  frame.seen_fraction = 0.9;
  EXPECT_EQ(make().status, FrameStatus::ok);
  frame.seen_fraction = 0.8999;
  const FrameMessage message = make();
  EXPECT_EQ(message.status, FrameStatus::incomplete);
  EXPECT_FALSE(message.valid());
  EXPECT_TRUE(message.distance_m.has_value());
}

// 500 photons in 50 ms are 1e-5 a ns: a dead time of 9900 ns and S = 1e-3 make 0.1. A tenth of a
// signal of two deviations is a fifth of one.
TEST_F(FrameMessages, AreSaturatedWhereATenthFallsIntoDeadTime) {
  estimate.std_signal_per_pulse = estimate.signal_per_pulse / 2;
  context.dead_time_ns = 9'899;
  EXPECT_EQ(make().status, FrameStatus::ok);
  context.dead_time_ns = 9'901;
  EXPECT_EQ(make().status, FrameStatus::saturated);
  EXPECT_FALSE(make().valid());
  context.dead_time_ns = 0;
  EXPECT_EQ(make().status, FrameStatus::ok);
}

// A signal of 400 deviations that reads low by 1.5 permille is low by 0.6 of them: 1 permille by
// the dead time of 500 photons in 50 ms, and half a permille by half of S = 1e-3.
TEST_F(FrameMessages, AreSaturatedWhereTheDeadTimeBiasesTheSignalByHalfOfItsDeviation) {
  context.dead_time_ns = 100;
  estimate.signal_per_pulse = 1e-3;
  estimate.std_signal_per_pulse = 1e-3 / 400;
  EXPECT_EQ(make().status, FrameStatus::ok);
  context.models_dead_time = true;
  EXPECT_EQ(make().status, FrameStatus::saturated);
  context.inputs = 2;
  EXPECT_EQ(make().status, FrameStatus::ok);
  context.inputs = 1;
  estimate.std_signal_per_pulse = 1e-3 / 320;
  EXPECT_EQ(make().status, FrameStatus::ok);
  estimate.std_signal_per_pulse = 1e-3 / 400;
  estimate.dead_time_modelled = true;
  EXPECT_EQ(make().status, FrameStatus::ok);
}

TEST(UnmodelledBy, NamesWhatLeavesTheDeadTimeOut) {
  Config config;
  config.scene.targets = 2;
  config.estimator.method = Method::paper;
  EXPECT_EQ(unmodelled_by(config), "");
  config.detector.dead_time_ns = 50;
  EXPECT_EQ(unmodelled_by(config), "estimator.method paper");
  config.estimator.method = Method::search;
  config.pulse.width = PulseWidth::fitted;
  EXPECT_EQ(unmodelled_by(config), "");
  config.estimator.method = Method::paper;
  config.detector.dead_time = DeadTime::flagged;
  EXPECT_EQ(unmodelled_by(config), "");
}

// Nine tenths of the time dead are ten would-be detections in a dead time.
TEST_F(FrameMessages, WithTheDeadTimeModelledAreSaturatedBeyondTheModelOnly) {
  context.dead_time_ns = 1e6;
  EXPECT_FALSE(make().blind_fraction.has_value());
  estimate.dead_time_modelled = true;
  estimate.blind_fraction = 0.909;
  EXPECT_EQ(make().status, FrameStatus::ok);
  EXPECT_EQ(make().blind_fraction, 0.909);
  estimate.blind_fraction = 0.9092;
  EXPECT_EQ(make().status, FrameStatus::saturated);
  estimate.blind_fraction = 0.5;
  estimate.signal_per_pulse = 10.1;
  EXPECT_EQ(make().status, FrameStatus::saturated);
  estimate.signal_per_pulse = 9.9;
  EXPECT_EQ(make().status, FrameStatus::ok);
}

// Ten times the amplitudes with a tenth of the signal are the same light.
TEST_F(FrameMessages, AreSaturatedByTheLightOfAPulseWhateverItsAmplitude) {
  context.dead_time_ns = 1;
  context.mean_amplitude = 10;
  estimate.signal_per_pulse = 0.011;
  EXPECT_EQ(make().status, FrameStatus::saturated);
  estimate.signal_per_pulse = 0.009;
  EXPECT_EQ(make().status, FrameStatus::ok);
  estimate.dead_time_modelled = true;
  EXPECT_EQ(make().status, FrameStatus::ok);
  estimate.signal_per_pulse = 1.1;
  EXPECT_EQ(make().status, FrameStatus::saturated);
}

TEST_F(FrameMessages, AreSaturatedWhereInputsShareTheLightTooUnevenly) {
  context.dead_time_ns = 50;
  estimate.dead_time_modelled = true;
  estimate.signal_per_pulse = 1;
  estimate.std_signal_per_pulse = 0.002;
  estimate.low_by_split = 0.0009;
  EXPECT_EQ(make().status, FrameStatus::ok);
  estimate.low_by_split = 0.0011;
  EXPECT_EQ(make().status, FrameStatus::saturated);
  estimate.has_values = false;
  EXPECT_NE(make().status, FrameStatus::saturated);
}

TEST_F(FrameMessages, WithoutSyncStillCount) {
  frame.sync = {};
  frame.sync.count = 2;
  frame.seen_fraction = 0.5;
  frame.lost_tags = 9;
  estimate = {};
  estimate.status = FrameStatus::no_sync;
  estimate.background_per_ns = 1e-5;
  const FrameMessage message = make();
  EXPECT_EQ(message.status, FrameStatus::no_sync);
  EXPECT_EQ(message.photons, 500u);
  EXPECT_EQ(message.lost_tags, 9u);
  EXPECT_EQ(message.sync->count, 2u);
  EXPECT_FALSE(message.sync->period_ps.has_value());
  EXPECT_DOUBLE_EQ(message.background_per_s.value(), 1e4);
  EXPECT_DOUBLE_EQ(message.background_per_period.value(), 0.0378);
  EXPECT_FALSE(message.distance_m.has_value());
  EXPECT_FALSE(message.std_background_per_s.has_value());
}

TEST_F(FrameMessages, WithoutTargetSayNothingOfIt) {
  estimate.status = FrameStatus::no_target;
  const FrameMessage message = make();
  EXPECT_EQ(message.status, FrameStatus::no_target);
  EXPECT_FALSE(message.distance_m.has_value());
  EXPECT_FALSE(message.velocity_mps.has_value());
  EXPECT_FALSE(message.signal_per_pulse.has_value());
  EXPECT_TRUE(message.background_per_s.has_value());
  EXPECT_EQ(message.significance, 900);
  EXPECT_FALSE(message.range_odds_nats.has_value());
}

// As of a scene without background: its likelihood is highest at none, and one photon in 50 ms,
// 2e-8 a ns, is its deviation.
TEST_F(FrameMessages, OfNoBackgroundHaveNoneAndNoRatio) {
  estimate.std_background_per_ns = 2e-8;
  for (const double background_per_ns : {0.0, 1e-20, 1e-15}) {
    estimate.background_per_ns = background_per_ns;
    const FrameMessage message = make();
    EXPECT_EQ(message.background_per_s, 0);
    EXPECT_EQ(message.background_per_period, 0);
    EXPECT_DOUBLE_EQ(message.std_background_per_s.value(), 20);
    EXPECT_FALSE(message.sbr.has_value());
  }
}

TEST_F(FrameMessages, OfABackgroundThatMayBeNoneHaveNoRatio) {
  estimate.background_per_ns = 3e-8;
  estimate.std_background_per_ns = 2e-8;
  EXPECT_DOUBLE_EQ(make().background_per_s.value(), 30);
  EXPECT_FALSE(make().sbr.has_value());
  estimate.background_per_ns = 4e-8;
  EXPECT_TRUE(make().sbr.has_value());
}

TEST(FrameContext, SumsTheAmplitudesOfAllPulsesInAPeriod) {
  Config config;
  config.pattern.mode = Mode::mrr;
  config.pattern.segments = {{1000, {0}, {0.5}, 10}, {1100, {0, 10}, {1, 2}, 20}};
  const FrameContext context = frame_context(config);
  EXPECT_DOUBLE_EQ(context.amplitude_per_period, 5 + 60);
  EXPECT_DOUBLE_EQ(context.mean_amplitude, 65.0 / 50);
  EXPECT_DOUBLE_EQ(context.period_ps, 32'000);
  // A single segment is one period, however often it is played.
  config.pattern.mode = Mode::interleaved;
  config.pattern.segments = {{1000, {0, 300}, {0.5, 1.5}, 10}};
  EXPECT_DOUBLE_EQ(frame_context(config).amplitude_per_period, 2);
}

}  // namespace
}  // namespace splid
