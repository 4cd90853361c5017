#include "daemon/study/truth_score.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace splid {
namespace {

using testing::HasSubstr;

// A target at rest, 100 m away, for a second.
SceneTruth truth_at_rest() {
  SceneTruth truth;
  truth.step_ps = 1'000'000'000'000;
  truth.distance_m = {100, 100};
  truth.velocity_mps = {0, 0};
  return truth;
}

FrameMessage frame(std::uint64_t sequence, double distance_m, double velocity_mps = 0) {
  FrameMessage message;
  message.sequence = sequence;
  message.status = FrameStatus::ok;
  message.start_ps = static_cast<std::int64_t>(sequence) * 50'000'000'000;
  message.duration_ms = 50;
  message.distance_m = distance_m;
  message.std_distance_m = 0.001;
  message.velocity_mps = velocity_mps;
  message.std_velocity_mps = 0.05;
  return message;
}

TEST(TruthScore, SumsUpErrors) {
  TruthScore score(truth_at_rest());
  EXPECT_NEAR(score.take(frame(0, 100.003, 0.1))->distance_m, 0.003, 1e-9);
  EXPECT_NEAR(score.take(frame(1, 99.999, -0.1))->velocity_mps, -0.1, 1e-9);
  EXPECT_NEAR(score.distance_rmse_mm().value(), std::sqrt(5.0), 1e-9);
  EXPECT_NEAR(score.velocity_rmse_cmps().value(), 10, 1e-9);
  EXPECT_FALSE(score.broken({3, 11}));
  EXPECT_THAT(score.broken({2, 11}).value_or(""), HasSubstr("distance RMSE is 2.236 mm"));
  EXPECT_THAT(score.broken({3, 9}).value_or(""), HasSubstr("velocity RMSE is 10 cm/s"));
  EXPECT_FALSE(score.broken({}));
}

TEST(TruthScore, WrongPeaksAreCountedAndLeftOutOfTheRmse) {
  TruthScore score(truth_at_rest());
  EXPECT_FALSE(score.take(frame(0, 100.0099))->wrong_peak);
  EXPECT_TRUE(score.take(frame(1, 101.35))->wrong_peak);
  EXPECT_TRUE(score.take(frame(2, 100, 0.51))->wrong_peak);
  EXPECT_EQ(score.wrong_peaks(), 2u);
  EXPECT_NEAR(score.distance_rmse_mm().value(), 9.9, 1e-6);
  EXPECT_THAT(score.broken({100, 100}).value_or(""), HasSubstr("2 frames are on a wrong peak"));
}

TEST(TruthScore, GapsInTheSequenceAreLostFrames) {
  TruthScore score(truth_at_rest());
  score.take(frame(3, 100));
  score.take(frame(4, 100));
  score.take(frame(9, 100));
  EXPECT_EQ(score.lost(), 4u);
  EXPECT_THAT(score.broken({1, 1}).value_or(""), HasSubstr("4 frames are missing"));
}

TEST(TruthScore, FramesWithoutValuesOrTruthAreNotCompared) {
  TruthScore score(truth_at_rest());
  FrameMessage dark = frame(0, 0);
  dark.status = FrameStatus::no_target;
  dark.distance_m.reset();
  EXPECT_FALSE(score.take(dark));
  EXPECT_FALSE(score.take(frame(1000, 100)));  // 50 s
  EXPECT_EQ(score.compared(), 0u);
  EXPECT_EQ(score.frames(), 2u);
  EXPECT_FALSE(score.distance_rmse_mm());
  EXPECT_THAT(score.broken({1, 1}).value_or(""), HasSubstr("no valid frame"));
}

TEST(TruthScore, NineOfTenMustBeValid) {
  TruthScore score(truth_at_rest());
  for (std::uint64_t i = 0; i < 8; ++i) score.take(frame(i, 100));
  FrameMessage dark = frame(8, 0);
  dark.status = FrameStatus::no_sync;
  score.take(dark);
  EXPECT_THAT(score.broken({1, 1}).value_or(""), HasSubstr("only 8 of 9"));
  score.take(frame(9, 100));
  EXPECT_FALSE(score.broken({1, 1}));
}

TEST(TruthScore, AFrameThatIsNotSureOfItsRangeIsOnNoWrongPeak) {
  TruthScore score(truth_at_rest());
  score.take(frame(0, 100));
  FrameMessage unsure = frame(1, 140);
  unsure.mode = Mode::random;
  unsure.status = FrameStatus::ambiguous;
  EXPECT_FALSE(score.take(unsure));
  EXPECT_EQ(score.wrong_peaks(), 0u);
  EXPECT_THAT(score.summary(), HasSubstr("1 not sure of their range"));
  EXPECT_THAT(score.broken({1, 1}).value_or(""), HasSubstr("only 1 of 2"));
  unsure.mode = Mode::ambiguous;  // every frame is, and says nothing by it
  unsure.sequence = 2;
  EXPECT_TRUE(score.take(unsure)->wrong_peak);
}

TEST(EncoderScore, ComparesWithTheReferenceInTheFrames) {
  EncoderScore score;
  FrameMessage near = frame(0, 100.02, 0.3);
  near.reference = FrameMessage::Reference{100, 0.1};
  EXPECT_FALSE(score.take(near)->wrong_peak);
  FrameMessage far = frame(1, 101.35);
  far.reference = FrameMessage::Reference{100, 0};
  EXPECT_TRUE(score.take(far)->wrong_peak);
  EXPECT_FALSE(score.take(frame(2, 100)));
  EXPECT_THAT(score.summary(), HasSubstr("3 valid, 2 compared with the encoder, 1 wrong peaks "
                                         "(more than 0.5 m off); distance RMSE 20.000 mm, "
                                         "velocity RMSE 20.000 cm/s"));
}

}  // namespace
}  // namespace splid
