#include "protocol/truth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "protocol/error.hpp"

namespace splid {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

SceneTruth example() {
  SceneTruth truth;
  truth.start_ps = 340'000'000'000'000'001;
  truth.step_ps = 1'000'000'000;
  truth.distance_m = {284.5, 284.5012, 284.5031};
  truth.velocity_mps = {1.1, 1.3, 2.5};
  truth.signal_per_pulse = 13.5e-4;
  truth.background_per_s = 175'000;
  truth.sigma_ps = 100;
  truth.electronic_delay_ns = 1855;
  truth.drift_ppm = 2;
  truth.drift_ramp_ppm_per_s = -0.125;
  return truth;
}

std::string changed(const std::string& from, const std::string& to) {
  std::string text = to_json(example());
  return text.replace(text.find(from), from.size(), to);
}

TEST(Truth, EncodingIsPinned) {
  EXPECT_EQ(to_json(example()),
            R"({"schema":"splid.truth","v":[1,0],"start_ps":"340000000000000001",)"
            R"("step_ps":1000000000,"signal_per_pulse":0.00135,"background_per_s":175000.0,)"
            R"("sigma_ps":100.0,"electronic_delay_ns":1855.0,"drift_ppm":2.0,)"
            R"("drift_ramp_ppm_per_s":-0.125,"distance_m":[284.5,284.5012,284.5031],)"
            R"("velocity_mps":[1.1,1.3,2.5]})");
}

TEST(Truth, ComesBackFromItsText) { EXPECT_EQ(truth_from_json(to_json(example())), example()); }

TEST(Truth, HoldsFurtherTargets) {
  SceneTruth truth = example();
  truth.more_targets = {{5e-4, {282.5, 282.5, 282.5}, {0, 0, 0}}};
  const std::string text = to_json(truth);
  EXPECT_THAT(text,
              HasSubstr(R"("more_targets":[{"signal_per_pulse":0.0005,"distance_m":[282.5,)"));
  EXPECT_EQ(truth_from_json(text), truth);
  const auto reading = [](const std::string& json) { return [json] { truth_from_json(json); }; };
  truth.more_targets.front().velocity_mps.pop_back();
  EXPECT_THAT(reading(to_json(truth)), ThrowsMessage<Error>(HasSubstr("/more_targets/0")));
  EXPECT_THAT(reading(std::string(text).replace(text.find("0.0005"), 6, "null")),
              ThrowsMessage<Error>(HasSubstr("/signal_per_pulse")));
}

TEST(Truth, HoldsPixels) {
  SceneTruth truth = example();
  truth.crosstalk_probability = 0.01;
  truth.crosstalk_ns = 1.5;
  truth.pixels = {{3, 0.5, -0.25, 120, 5e-4, 7000, {28, 29, 30}, {0, 1, 2}}};
  const std::string text = to_json(truth);
  EXPECT_THAT(text, HasSubstr(R"("crosstalk_probability":0.01,"crosstalk_ns":1.5,"pixels":[{)"
                              R"("input":3,"azimuth_deg":0.5,"elevation_deg":-0.25,)"));
  EXPECT_EQ(truth_from_json(text), truth);
  const auto state = truth.at(truth.start_ps + truth.step_ps, truth.pixels[0]);
  ASSERT_TRUE(state);
  EXPECT_EQ(state->distance_m, 29);
  EXPECT_EQ(state->velocity_mps, 1);
  truth.pixels[0].distance_m.pop_back();
  const auto reading = [&] { truth_from_json(to_json(truth)); };
  EXPECT_THAT(reading, ThrowsMessage<Error>(HasSubstr("/pixels/0 has another number")));
}

TEST(Truth, OfAScanIsThatOfThePixelInItsDwell) {
  SceneTruth truth = example();
  truth.dwell_ps = 100;
  truth.pixels = {{3, 0, 0, 0, 5e-4, 7000, {28, 29, 30}, {0, 0, 0}, 50},
                  {3, 1, 0, 0, 5e-4, 7000, {38, 39, 40}, {0, 0, 0}, 150}};
  const std::string text = to_json(truth);
  EXPECT_THAT(text, AllOf(HasSubstr(R"("dwell_ps":100,)"), HasSubstr(R"("first_ps":150})")));
  EXPECT_EQ(truth_from_json(text), truth);
  const std::int64_t second_ps = truth.start_ps + truth.step_ps;  // the second picture's
  EXPECT_NEAR(truth.at(second_ps + 50)->distance_m, 29, 1e-9);
  EXPECT_NEAR(truth.at(second_ps + 99)->distance_m, 29, 1e-6);
  EXPECT_NEAR(truth.at(second_ps + 100)->distance_m, 39, 1e-6);
  EXPECT_FALSE(truth.at(second_ps + 200)) << "no pixel's dwell";
  EXPECT_FALSE(truth.at(truth.start_ps + 49)) << "before the first sample";
  EXPECT_FALSE(truth.at(truth.start_ps - 50, truth.pixels[1]));
  truth.pixels[1].first_ps = -1;
  const auto reading = [&] { truth_from_json(to_json(truth)); };
  EXPECT_THAT(reading, ThrowsMessage<Error>(HasSubstr("/pixels/1/first_ps is negative")));
}

TEST(Truth, FaultsNameTheirMember) {
  const auto reading = [](const std::string& text) { return [text] { truth_from_json(text); }; };
  EXPECT_THAT(reading("{"), ThrowsMessage<Error>(HasSubstr("byte")));
  EXPECT_THAT(reading("[]"), ThrowsMessage<Error>(HasSubstr("object")));
  EXPECT_THAT(reading("[1e999]"), ThrowsMessage<Error>(HasSubstr("too large")));
  EXPECT_THAT(reading(std::string(100'000, '[')), ThrowsMessage<Error>(HasSubstr("too deeply")));
  EXPECT_THAT(reading(changed("splid.truth", "splid.frame")),
              ThrowsMessage<Error>(HasSubstr("/schema")));
  EXPECT_THAT(reading(changed("[1,0]", "[2,0]")), ThrowsMessage<Error>(HasSubstr("/v ")));
  EXPECT_THAT(reading(changed("\"340000000000000001\"", "\"34x\"")),
              ThrowsMessage<Error>(HasSubstr("/start_ps")));
  EXPECT_THAT(reading(changed("1000000000,", "0,")), ThrowsMessage<Error>(HasSubstr("/step_ps")));
  EXPECT_THAT(reading(changed("284.5012", "null")),
              ThrowsMessage<Error>(HasSubstr("/distance_m/1")));
  EXPECT_THAT(reading(changed("1.1,", "")), ThrowsMessage<Error>(HasSubstr("/velocity_mps")));
  EXPECT_THAT(reading(changed("sigma_ps", "sigma")), ThrowsMessage<Error>(HasSubstr("/sigma_ps")));
}

TEST(Truth, SamplesAreMet) {
  const SceneTruth truth = example();
  for (int i = 0; i < 3; ++i) {
    const auto state = truth.at(truth.start_ps + i * truth.step_ps);
    ASSERT_TRUE(state);
    EXPECT_EQ(state->distance_m, truth.distance_m[i]);
    EXPECT_EQ(state->velocity_mps, truth.velocity_mps[i]);
  }
  EXPECT_FALSE(truth.at(truth.start_ps - 1));
  EXPECT_FALSE(truth.at(truth.start_ps + 2 * truth.step_ps + 1));
}

// A cubic with its slopes is met exactly: z = 5 + 2 t - 3 t^2 + 4 t^3, a sample a second.
TEST(Truth, CubicsAreMetBetweenSamples) {
  SceneTruth truth;
  truth.step_ps = 1'000'000'000'000;
  truth.distance_m = {5, 8, 29};
  truth.velocity_mps = {2, 8, 38};
  for (const double t : {0.25, 0.5, 1.75}) {
    const auto state = truth.at(static_cast<std::int64_t>(t * 1e12));
    ASSERT_TRUE(state);
    EXPECT_NEAR(state->distance_m, 5 + 2 * t - 3 * t * t + 4 * t * t * t, 1e-12) << t;
  }
  EXPECT_DOUBLE_EQ(truth.at(500'000'000'000)->velocity_mps, 5);
}

}  // namespace
}  // namespace splid
