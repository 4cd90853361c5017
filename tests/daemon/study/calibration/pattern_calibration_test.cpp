#include "daemon/study/calibration/pattern_calibration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <vector>

#include "daemon/study/calibration/calibration_report.hpp"
#include "daemon/study/tradeoff/tradeoff_frames.hpp"
#include "drivers/simulator/simulator.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "protocol/error.hpp"
#include "protocol/pattern_json.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/matches.hpp"
#include "tests/support/program.hpp"
#include "tests/support/scene_runs.hpp"
#include "tests/support/scripted_source.hpp"

namespace splid::calibration {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double light_m_per_ps = 299792458e-12;

// What is played: uneven times and amplitudes, which the configured pattern knows nothing of.
Pattern played() {
  Pattern pattern = test::random_pattern(1'000'000, 12, 9000, 4);
  auto& segment = pattern.segments.front();
  for (std::size_t p = 0; p < segment.amplitudes.size(); ++p) {
    segment.amplitudes[p] = p % 2 == 0 ? 1.4 : 0.6;
  }
  return pattern;
}

simulator::Options scene_at_rest() {
  simulator::Options scene;
  scene.pace = simulator::Speed::max;
  scene.target.motion = simulator::MotionKind::linear;
  scene.target.distance_m = 30;
  scene.detection.signal_per_pulse = 0.08;  // 960,000 a second
  scene.seconds = 1;
  return scene;
}

Config config_of_one_pulse() {
  Config config = scene_config(1);
  config.pattern_file = "nominal.json";
  config.pattern = test::periodic_pattern(1'000'000);
  return config;
}

PatternCalibration calibrate_scene(const simulator::Options& scene, const Plan& plan = {},
                                   const std::stop_token& stop = {},
                                   const Config& config = config_of_one_pulse(),
                                   const Pattern& pattern = played()) {
  const auto open = [&] { return std::make_unique<simulator::Source>(scene, pattern); };
  return calibrate_pattern(
      config, open, plan, [](const char*, double) {}, stop);
}

std::string refusal_of(const simulator::Options& scene, const Plan& plan = {}) {
  try {
    (void)calibrate_scene(scene, plan);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::data);
    return error.what();
  }
  return "none";
}

// The generator's clock is 2 ppm slow, the light's way is not.
std::vector<double> arrivals_ps(double delay_ps) {
  constexpr double rate = 1 + 2e-6;
  std::vector<double> times;
  const Pattern pattern = played();
  for (const double time_ps : pattern.segments.front().pulse_times_ps) {
    times.push_back(std::fmod(time_ps * rate + delay_ps, 1e6 * rate));
  }
  return times;
}

TEST(PatternCalibration, AMillionPhotonsShowThePatternThatWasPlayed) {
  Plan plan;
  plan.recording = "still.ptu";
  for (const bool distance_known : {false, true}) {
    if (distance_known) plan.distance_m = 30;
    const PatternCalibration found = calibrate_scene(scene_at_rest(), plan);
    const PatternSegment& segment = found.pattern.segments.front();
    ASSERT_EQ(segment.pulse_times_ps.size(), 12U);
    EXPECT_EQ(found.pattern.mode, Mode::random);
    // A target without a distance is where noise does not wrap it.
    EXPECT_NEAR(found.target_m, distance_known ? 30 : 1'000'002 * light_m_per_ps / 4, 1e-6);
    EXPECT_NEAR(found.calibration.signal_photons, 960'000, 5'000);
    const auto truth_ps = arrivals_ps(distance_known ? 0 : 60 / light_m_per_ps + 500'001);
    for (std::size_t p = 0; p < 12; ++p) {
      // In ascending order: those after the period's end come first.
      const auto at = std::min_element(truth_ps.begin(), truth_ps.end(), [&](double a, double b) {
        return std::abs(a - segment.pulse_times_ps[p]) < std::abs(b - segment.pulse_times_ps[p]);
      });
      EXPECT_NEAR(segment.pulse_times_ps[p], *at, 2) << p;
      const auto index = static_cast<std::size_t>(at - truth_ps.begin());
      EXPECT_NEAR(segment.amplitudes[p] / played().segments.front().amplitudes[index], 1, 0.02);
    }
    EXPECT_NEAR(*found.pattern.calibrated_period_ps, 1'000'002, 1e-5);
    EXPECT_LT(found.pattern.calibration->std_period_ps, 2e-6);
    EXPECT_EQ(pattern_from_json(to_json(found.pattern), "found"), found.pattern);
    EXPECT_EQ(validate(found.pattern), std::nullopt);
    EXPECT_FALSE(found.rest.wanders());
    EXPECT_LT(std::abs(found.rest.walk_ps()), 3);
  }
}

// With the pattern's clock as the reference the times are those that the generator was told to
// play, 10 ppm slow as it is: at the end of the period 10 ps less than the tagger counts.
TEST(PatternCalibration, InThePatternsClockThePeriodIsTheNominalOne) {
  Plan plan;
  plan.distance_m = 30;
  Config config = config_of_one_pulse();
  config.drift.reference = ClockReference::pattern;
  simulator::Options scene = scene_at_rest();
  scene.drift_ppm = 10;
  scene.tagger_ppm = 10;
  const Pattern found = calibrate_scene(scene, plan, {}, config).pattern;
  const PatternSegment& segment = found.segments.front();
  const std::vector<double> played_ps = played().segments.front().pulse_times_ps;
  ASSERT_EQ(segment.pulse_times_ps.size(), played_ps.size());
  EXPECT_EQ(segment.period_ps, 1'000'000);
  EXPECT_EQ(found.unambiguous_delay_ps, 1'000'000);
  EXPECT_NEAR(*found.calibrated_period_ps, 1'000'010, 1e-4);
  for (std::size_t p = 0; p < played_ps.size(); ++p) {
    EXPECT_NEAR(segment.pulse_times_ps[p], played_ps[p], 2) << p;
  }
  EXPECT_EQ(validate(found), std::nullopt);
}

struct Distances {
  double bias_mm = 0;  // mean error
  double rms_mm = 0;
  double published_mm = 0;  // mean deviation
  double frames = 0;
};

Distances measure(const std::vector<tradeoff::KeptFrame>& frames, const Pattern& pattern,
                  Shape shape) {
  PulseOptions pulse;
  pulse.shape = shape;
  FrameEstimator estimator(pattern, pulse, {}, {}, 50, 200'000);
  constexpr double mm_per_ns = light_m_per_ps * 1e3 / 2 * 1e3;
  Distances distances;
  for (const tradeoff::KeptFrame& frame : frames) {
    const Estimate estimate = estimator.estimate(frame.view());
    EXPECT_TRUE(estimate.has_values);
    const double error_mm = (estimate.delay_ns - frame.truth->delay_ns) * mm_per_ns;
    distances.bias_mm += error_mm;
    distances.rms_mm += error_mm * error_mm;
    distances.published_mm += estimate.std_delay_ns * mm_per_ns;
    distances.frames += 1;
  }
  distances.bias_mm /= distances.frames;
  distances.rms_mm = std::sqrt(distances.rms_mm / distances.frames);
  distances.published_mm /= distances.frames;
  return distances;
}

// Frames of another recording of the scene, measured with the calibrated times: a gaussian is off,
// the calibrated shape is not, and its deviations are those of its errors.
TEST(PatternCalibration, ATailsBiasIsGone) {
  simulator::Options scene = scene_at_rest();
  scene.detection.tail_fraction = 0.3;
  scene.detection.tail_ps = 300;
  Plan plan;
  plan.distance_m = 30;
  const Pattern found = calibrate_scene(scene, plan).pattern;
  EXPECT_GT(make_tabulated(*found.pulse)->last_ns(), 1.2);

  scene.seed = 2;
  scene.detection.signal_per_pulse = 0.01;
  Config config = scene_config(1);
  config.pattern = played();
  const tradeoff::FrameOrigin origin{"scene", scene, {}, std::nullopt, {}};
  const auto frames = tradeoff::collect_frames(config, origin, 50, 30, [](std::size_t) {}, {});
  ASSERT_GE(frames.size(), 30U);
  const Distances gaussian = measure(frames, found, Shape::gaussian);
  const Distances calibrated = measure(frames, found, Shape::tabulated);
  const double noise_mm = calibrated.published_mm / std::sqrt(calibrated.frames);
  EXPECT_GT(std::abs(gaussian.bias_mm), 20 * noise_mm);
  EXPECT_LT(std::abs(calibrated.bias_mm), 3.5 * noise_mm);
  EXPECT_NEAR(calibrated.rms_mm / calibrated.published_mm, 1, 0.4);  // 13 % for 30 frames
}

TEST(PatternCalibration, MotionIsRefusedWithItsVelocity) {
  simulator::Options scene = scene_at_rest();
  scene.target.velocity_mps = 0.003;  // 20 ps in all
  const std::string slow = refusal_of(scene);
  EXPECT_THAT(slow, AllOf(HasSubstr("the target moves, v = "), HasSubstr("5 ps are allowed")));
  const std::string velocity = "v = (\\S+) \\+- (\\S+) mm/s";
  auto figures = test::first_match(slow, velocity);
  ASSERT_FALSE(figures.empty()) << slow;
  EXPECT_NEAR(std::stod(figures[1]), 3, 4 * std::stod(figures[2]));
  EXPECT_LT(std::stod(figures[2]), 0.15);
  Plan lenient;
  lenient.goal.std_time_ps = 50;
  EXPECT_EQ(refusal_of(scene, lenient), "none");

  scene.target.velocity_mps = -0.5;
  const std::string fast = refusal_of(scene);
  figures = test::first_match(fast, velocity);
  ASSERT_FALSE(figures.empty()) << fast;
  EXPECT_NEAR(std::stod(figures[1]), -500, 25);

  scene.target.motion = simulator::MotionKind::sinusoid;
  scene.target.amplitude_m = 0.002;
  scene.target.period_s = 0.25;
  scene.target.phase_turns = 0.25;  // symmetric in time: the delay ends where it began
  EXPECT_THAT(refusal_of(scene), HasSubstr("the target moves to and fro: its delay wanders by "));
}

// As many as it asks for are enough.
TEST(PatternCalibration, TooFewPhotonsAreRefusedWithHowManyItNeeds) {
  simulator::Options scene = scene_at_rest();
  scene.detection.signal_per_pulse = 0.004;
  scene.seconds = 0.25;
  const std::string refused = refusal_of(scene);
  const auto figures =
      test::first_match(refused, "it needs ([0-9,]+) more signal photons, (\\S+) s more");
  ASSERT_FALSE(figures.empty()) << refused;
  const double more_s = std::stod(figures[2]);
  EXPECT_GT(more_s, 0.1);
  scene.seconds += 0.6 * more_s;
  EXPECT_THAT(refusal_of(scene), HasSubstr("too few photons"));
  scene.seconds += 0.6 * more_s;
  EXPECT_EQ(refusal_of(scene), "none");
}

// Such as of a width in ns.
TEST(PatternCalibration, AWidthThatThePhotonsContradictIsRefusedWithTheirs) {
  Config config = config_of_one_pulse();
  config.file = "my.json";
  simulator::Options scene = scene_at_rest();
  scene.seconds = 0.3;
  for (const double configured_ps : {1.0, 10.0, 3'000.0}) {
    config.pulse.sigma_ps = configured_ps;
    const std::string said =
        test::error_text([&] { (void)calibrate_scene(scene, {}, {}, config); });
    const auto figures = test::first_match(
        said,
        "its pulses are (\\S+) times (wider|narrower) than configured; set pulse.sigma_ps of "
        "my.json to (\\S+) and repeat");
    ASSERT_FALSE(figures.empty()) << said;
    EXPECT_EQ(figures[2], configured_ps < 100 ? "wider" : "narrower");
    EXPECT_NEAR(std::stod(figures[3]), 100, 40);
  }
  config.pulse.sigma_ps = 50;
  EXPECT_NO_THROW((void)calibrate_scene(scene, {}, {}, config));
}

// A number of photons or seconds that no recording has is not printed.
TEST(PatternCalibration, WhatNoRecordingWouldHaveIsNotAskedFor) {
  simulator::Options scene = scene_at_rest();
  scene.seconds = 0.25;
  Plan plan;
  plan.goal.std_time_ps = 1e-6;
  EXPECT_THAT(refusal_of(scene, plan),
              AllOf(HasSubstr("to far less than what is asked for"), HasSubstr("--time-ps"),
                    testing::Not(HasSubstr("it needs"))));
}

TEST(PatternCalibration, ADistanceThatCannotBeIsRefused) {
  simulator::Options scene = scene_at_rest();
  scene.seconds = 0.1;
  for (const char* distance : {"nan", "inf", "-1e17"}) {
    Plan plan;
    plan.distance_m = std::strtod(distance, nullptr);
    EXPECT_THAT(test::error_text([&] { (void)calibrate_scene(scene, plan); }),
                HasSubstr("must be from -1000000 to 1000000 m"));
    const std::vector<std::vector<std::string>> commands = {
        {"calibrate", "a.ptu", "-c", "a.json", "-o", "no.json", "--distance-m", distance},
        {"ctl", "calibrate", "--seconds", "1", "-o", "no.json", "--distance-m", distance}};
    for (const std::vector<std::string>& command : commands) {
      const test::ProgramResult result = test::run_program(command);
      EXPECT_EQ(result.exit_code, 2);
      EXPECT_THAT(result.err, HasSubstr("must be a number from -1000000 to 1000000"));
    }
  }
}

// So far away that all pulses have the same time in a double.
TEST(PatternCalibration, APatternThatCouldNotBeReadIsRefused) {
  Config config = config_of_one_pulse();
  config.scene.range_offset_m = 1e17;
  Plan plan;
  plan.distance_m = 30;
  EXPECT_THAT(test::error_text([&] { (void)calibrate_scene(scene_at_rest(), plan, {}, config); }),
              HasSubstr("the pulses that were found are no pattern: /segments/0/pulse_times_ps/"));
}

TEST(PatternCalibration, WhatHoldsNoPatternIsRefused) {
  simulator::Options scene = scene_at_rest();
  scene.seconds = 0.2;
  scene.detection.signal_per_pulse = 0;
  EXPECT_THAT(refusal_of(scene), HasSubstr("no pulse stands out of the "));
  scene.sync.missing_fraction = 1;
  EXPECT_THAT(refusal_of(scene), HasSubstr("no frame has both syncs that agree and photons"));

  Config config = config_of_one_pulse();
  config.pattern = test::mrr_pattern({90'000, 94'500}, 1'890'000, 7e6);
  EXPECT_THROW((void)calibrate_scene(scene_at_rest(), {}, {}, config), Error);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW((void)calibrate_scene(scene_at_rest(), {}, stop.get_token()), Error);
}

// Eight pulses a sync of a laser at 80 MHz, even to 3 ps: what is left of 15 m is the comb's 1.87.
TEST(PatternCalibration, AnEvenCombIsAmbiguousAndSaysSo) {
  Pattern comb = test::periodic_pattern(100'000);
  PatternSegment& segment = comb.segments.front();
  segment = {100'000, {}, std::vector<double>(8, 1.0), 0};
  const double off_ps[] = {2, -1, 0, 3, -3, 1, -2, 0};
  for (int p = 0; p < 8; ++p) segment.pulse_times_ps.push_back(50 + 12'500 * p + off_ps[p]);
  simulator::Options scene = scene_at_rest();
  scene.detection.signal_per_pulse = 0.002;  // 8,000 photons a frame
  scene.seconds = 0.3;
  Config config = config_of_one_pulse();
  config.pattern = test::periodic_pattern(100'000);
  for (const double least_off : {1.0, 20.0}) {
    for (double& time_ps : segment.pulse_times_ps) {
      time_ps = std::round(time_ps / 12'500) * 12'500 + 50 +
                least_off * (time_ps - 50 - std::round(time_ps / 12'500) * 12'500);
    }
    const PatternCalibration found = calibrate_scene(scene, {}, {}, config, comb);
    ASSERT_EQ(found.pattern.segments.front().pulse_times_ps.size(), 8U);
    EXPECT_EQ(validate(found.pattern), std::nullopt);
    const std::string printed = summary(found, "found.json", 50);
    if (least_off == 1) {
      EXPECT_EQ(found.pattern.mode, Mode::ambiguous);
      EXPECT_NEAR(found.pattern.unambiguous_delay_ps, 12'500, 0.1);
      EXPECT_THAT(printed, HasSubstr("ranges 1.87371 m apart cannot be told apart"));
    } else {
      EXPECT_EQ(found.pattern.mode, Mode::random);
      EXPECT_THAT(printed, HasSubstr("hardest to tell from the right delay"));
    }
  }
}

// Of the densities in a table of photons, whose offsets are evenly spaced.
double integral_of(const std::string& csv) {
  std::istringstream lines(test::file_text(csv));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "offset_ps,density_per_ns,std_per_ns");
  std::vector<double> offsets_ps;
  double sum = 0;
  for (double offset_ps = 0, density = 0, noise = 0; std::getline(lines, line);) {
    EXPECT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &offset_ps, &density, &noise), 3) << line;
    offsets_ps.push_back(offset_ps);
    sum += density;
  }
  EXPECT_GT(offsets_ps.size(), 10U);
  return sum * (offsets_ps.at(1) - offsets_ps.at(0)) * 1e-3;
}

// The program itself: the pattern file can be measured with as its last words say, and the photons
// are there.
TEST(PatternCalibration, TheProgramsPatternFileIsMeasuredWith) {
  test::TempFolder folder;
  const auto config = [&](const std::string& name, const std::string& pattern) {
    return folder.write(name,
                        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator",)"
                        R"("pace":"max","signal_per_pulse":0.03,"target":{"motion":"linear",)"
                        R"("distance_m":30,"velocity_mps":0}},"publish":{"endpoint":"ipc://)" +
                            folder.path("socket") + R"("},)" + pattern + "}");
  };
  folder.write("nominal.json", to_json_file(played()));
  const std::string nominal = config("config.json", R"("pattern":{"file":"nominal.json"})");
  const std::string recording = folder.path("still.ptu");
  ASSERT_EQ(
      test::run_program({"simulate", "-c", nominal, "--seconds", "0.5", "-o", recording}).exit_code,
      0);
  const std::string found = folder.path("found.json");
  const std::string photons = folder.path("photons.csv");
  const auto calibrated = test::run_program(
      {"calibrate", recording, "-c", nominal, "-o", found, "--distance-m", "30", "--csv", photons});
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
  EXPECT_THAT(calibrated.out, HasSubstr("pulse         time ps       +-  amplitude       +-"));
  EXPECT_NEAR(integral_of(photons), 1, 0.05);
  const std::string members =
      R"("pattern":{"file":")" + found + R"("},"pulse":{"shape":"tabulated"})";
  EXPECT_THAT(calibrated.err, HasSubstr(members));
  const auto again = test::run_program({"calibrate", recording, "-c", nominal, "-o", found});
  EXPECT_EQ(again.exit_code, 2);

  const auto measured =
      test::run_program({"replay", recording, "-c", config("measure.json", members), "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_THAT(measured.out, HasSubstr(R"("status":"ok")"));
  EXPECT_THAT(measured.out, HasSubstr(R"("distance_m":30.00)"));
}

PatternCalibration calibrate_tags(const std::vector<Tag>& tags, const Config& config) {
  const auto open = [&]() -> std::unique_ptr<TagSource> {
    return std::make_unique<ScriptedSource>(tags, SourceInfo{"script", false, 0.0, false});
  };
  return calibrate_pattern(config, open, {}, [](const char*, double) {}, {});
}

// Pixel b is 250 ps late, has a wider pulse and less light around it; c counts nothing.
TEST(PatternCalibration, ReportsEachPixelsDelayPulseAndRate) {
  Config config = config_of_one_pulse();
  config.pixels.resize(3);
  for (int i = 0; i < 3; ++i) {
    config.pixels[i].input = i + 1;
    config.pixels[i].name = std::string(1, static_cast<char>('a' + i));
    config.channels.pixels.push_back(i + 1);
  }
  config.channels.delays_ps = {0, 100, 0};
  config.pixels[1].delay_ps = 100;
  simulator::Options scene = scene_at_rest();
  std::vector<Tag> tags = test::simulate(scene, played());
  scene.seed = 2;
  scene.detection.sigma_ps = 130;
  scene.ambient_per_s = 50'000;
  for (Tag tag : test::simulate(scene, played())) {
    if (tag.kind == TagKind::photon) tags.push_back(photon_tag(tag.time_ps + 250, 2));
  }
  std::stable_sort(tags.begin(), tags.end(),
                   [](const Tag& x, const Tag& y) { return x.time_ps < y.time_ps; });
  const PatternCalibration found = calibrate_tags(tags, config);
  ASSERT_EQ(found.pixels.size(), 3U);
  EXPECT_EQ(found.pattern.segments.front().pulse_times_ps.size(), 12U);
  const PixelReport& a = found.pixels[0];
  EXPECT_EQ(a.name, "a");
  EXPECT_NEAR(a.delay_ps, 0, 0.1);
  EXPECT_NEAR(a.width_ps, 100, 5);
  EXPECT_NEAR(a.background_per_s, 175'000, 5000);
  const PixelReport& b = found.pixels[1];
  EXPECT_TRUE(b.has_pulses);
  EXPECT_NEAR(b.delay_ps, 250, 5 * b.std_delay_ps);
  EXPECT_LT(b.std_delay_ps, 2);
  EXPECT_NEAR(b.width_ps, 130, 6);
  EXPECT_NEAR(b.background_per_s, 50'500, 5000);
  EXPECT_FALSE(found.pixels[2].has_pulses);
  EXPECT_EQ(found.pixels[2].background_per_s, 0);
  EXPECT_THAT(summary(found, "p.json", 50),
              AllOf(HasSubstr("\na               0.0     0.0 "), HasSubstr("\nb             2"),
                    HasSubstr("\nc                 -       -         -             0\n")));
}

// A row of three detectors that see the same pulses; the second's cable is 400 ps long. A detection
// of an outer one makes one in the middle, of the middle one as often in each of the outer ones.
TEST(PatternCalibration, ReportsCrosstalkBetweenPixels) {
  Config config = config_of_one_pulse();
  config.pixels.resize(3);
  config.channels.delays_ps = {0, 0, 0};
  for (int i = 0; i < 3; ++i) {
    config.pixels[i].input = i + 1;
    config.pixels[i].name = std::string(1, static_cast<char>('a' + i));
    config.channels.pixels.push_back(i + 1);
  }
  simulator::Options scene = scene_at_rest();
  scene.detection.signal_per_pulse = 0.04;
  scene.ambient_per_s = 200'000;
  scene.seconds = 0.5;
  scene.array.columns = 3;
  scene.array.inputs.resize(3);
  for (int i = 0; i < 3; ++i) {
    scene.array.inputs[i].input = i + 1;
    scene.array.inputs[i].distance_m = 30;
  }
  scene.array.inputs[1].delay_ps = 400;
  for (const double probability : {0.0, 0.02}) {
    scene.array.crosstalk_probability = probability;
    scene.array.crosstalk_ns = 2;
    const PatternCalibration found = calibrate_tags(test::simulate(scene, played()), config);
    const std::string printed = summary(found, "p.json", 50);
    if (probability == 0) {
      EXPECT_TRUE(found.crosstalk.empty()) << printed;
      continue;
    }
    ASSERT_EQ(found.crosstalk.size(), 4U) << printed;
    for (const Crosstalk& pair : found.crosstalk) {
      EXPECT_TRUE((pair.from == 1) != (pair.to == 1));
      const double share = pair.from == 1 ? probability / 2 : probability;
      EXPECT_NEAR(pair.share, share, 5 * pair.std_share);
      EXPECT_LT(pair.std_share, 0.002);
      EXPECT_NEAR(pair.delay_ns, 2, 5 * pair.std_delay_ns);
      EXPECT_LT(pair.std_delay_ns, 0.5);
    }
    EXPECT_THAT(printed, HasSubstr("\ncrosstalk from a to b: "));
  }
}

}  // namespace
}  // namespace splid::calibration
