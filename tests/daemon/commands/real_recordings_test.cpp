#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "estimator/model/vector_level.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/pattern_json.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/laser_recording.hpp"
#include "tests/support/program.hpp"
#include "tests/support/real_recording.hpp"

// The built program on recordings of real instruments, from the pattern that is in them to frames.

namespace splid {
namespace {

using splid::test::ProgramResult;
using splid::test::run_program;

class RealRecordings : public ::testing::Test {
 protected:
  void use(const std::string& name) {
    recording = test::real_recording_path(name).string();
    if (!std::filesystem::exists(recording)) {
      GTEST_SKIP() << recording << " is not there; SPLID_DATA names the folder of the recordings";
    }
  }

  // One pulse in the period of the quTAG's source, of which a calibration finds four.
  void write_nominal() const {
    folder.write("nominal.json",
                 R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline",)"
                 R"("unambiguous_delay_ps":12512.6,"segments":[{"period_ps":12512.6,)"
                 R"("pulse_times_ps":[0],"amplitudes":[1],"repeats":0}]})");
  }
  // pulse: a member with a comma before it, or nothing.
  [[nodiscard]] std::string write_config(const std::string& name, const std::string& photon,
                                         const std::string& pattern,
                                         const std::string& pulse = "") const {
    return folder.write(name, R"({"schema":"splid.config","v":[1,0],"source":{"driver":"replay",)"
                              R"("recording":")" +
                                  recording + R"("},"channels":{"photon":)" + photon +
                                  R"(},"pattern":{"file":")" + pattern + R"("})" + pulse +
                                  R"(,"pipeline":{"ring_capacity_tags":8388608},)"
                                  R"("publish":{"endpoint":"ipc://)" +
                                  folder.path("socket") + R"("}})");
  }

  [[nodiscard]] std::vector<FrameMessage> replay(const std::string& config) const {
    const ProgramResult result = run_program({"replay", recording, "--config", config, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<FrameMessage> frames;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) frames.push_back(frame_from_json(line));
    return frames;
  }

  splid::test::TempFolder folder;
  std::string recording;
};

// Spread of the distances about their mean, and the mean published deviation.
struct Spread {
  double measured_mm = 0;
  double published_mm = 0;
};

Spread spread_of(const std::vector<FrameMessage>& frames) {
  Spread spread;
  double mean_m = 0;
  const auto count = static_cast<double>(frames.size());
  for (const FrameMessage& frame : frames) {
    mean_m += *frame.distance_m / count;
    spread.published_mm += *frame.std_distance_m * 1e3 / count;
  }
  for (const FrameMessage& frame : frames) {
    spread.measured_mm += std::pow((*frame.distance_m - mean_m) * 1e3, 2) / (count - 1);
  }
  spread.measured_mm = std::sqrt(spread.measured_mm);
  return spread;
}

// Sharp before, a tail of some 150 ps after: five of those are seen.
void expect_tailed(const Pattern& pattern) {
  ASSERT_TRUE(pattern.pulse && pattern.calibration);
  EXPECT_GT(pattern.pulse->first_ps, -300);
  const auto steps = static_cast<double>(pattern.pulse->density.size());
  EXPECT_GT(pattern.pulse->first_ps + steps * pattern.pulse->step_ps, 700);
  for (const double std_ps : pattern.calibration->std_pulse_times_ps) EXPECT_LT(std_ps, 1);
}

// What `check` has measured since afterpulses are counted over all waits, and the period over all
// syncs: that of the first 16,384 syncs is 42 of its deviations off, as the source's clock wanders.
TEST_F(RealRecordings, QutagChecksAsBefore) {
  use("qutag_sync_t2.ptu");
  if (IsSkipped()) return;
  const ProgramResult checked = run_program({"check", recording});
  ASSERT_EQ(checked.exit_code, 0) << checked.err;
  for (const std::string line :
       {"sync period     12512.62583683 ps +- 0.00000042 ps", "input 1        afterpulsing 0.1752",
        "input 2        dead_time 22.63 +- 0.51 ns", "input 2        afterpulsing 0.2973"}) {
    EXPECT_NE(checked.out.find(line), std::string::npos) << line << "\n" << checked.out;
  }
}

// A pulsed source at rest: pattern and pulse are found in one detector's photons, then every frame
// measures the period, the jitter and a velocity of zero (an independent fit: 0 to 2.6 cm/s, +- 1
// to 2) with a smaller spread than any gaussian gives.
TEST_F(RealRecordings, QutagFramesMeasureASourceAtRest) {
  use("qutag_sync_t2.ptu");
  if (IsSkipped()) return;
  constexpr double range_m = 12512.626e-12 * 299792458 / 2;
  write_nominal();
  for (const std::string input : {"1", "2"}) {
    const std::string found = folder.path("found" + input + ".json");
    const ProgramResult calibrated =
        run_program({"calibrate", recording, "--config",
                     write_config("nominal" + input, input, "nominal.json"), "--output", found});
    ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
    EXPECT_NE(calibrated.err.find("4 pulses"), std::string::npos) << calibrated.err;
    EXPECT_NE(calibrated.err.find("target at rest"), std::string::npos) << calibrated.err;
    // Half of 12,512.626 ps there and back.
    EXPECT_NE(calibrated.err.find("the target reads 0.937798 m"), std::string::npos)
        << calibrated.err;
    expect_tailed(pattern_from_json(test::file_text(found), found));

    auto frames =
        replay(write_config("found" + input, input, found, R"(,"pulse":{"shape":"tabulated"})"));
    ASSERT_EQ(frames.size(), 6U);
    double drift_ppm = 0;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const FrameMessage& frame = frames[k];
      // The recording ends within the sixth frame.
      EXPECT_EQ(frame.status, k < 5 ? FrameStatus::ok : FrameStatus::incomplete);
      ASSERT_TRUE(frame.sync && frame.sync->period_ps && frame.sync->jitter_ps);
      EXPECT_NEAR(*frame.sync->period_ps, 12512.626, 0.005);
      drift_ppm += *frame.sync->drift_ppm / 6;
      EXPECT_GE(*frame.sync->jitter_ps, 9);
      EXPECT_LE(*frame.sync->jitter_ps, 12);
      ASSERT_TRUE(frame.velocity_mps && frame.std_velocity_mps && frame.std_distance_m);
      EXPECT_LT(std::abs(*frame.velocity_mps), 3 * *frame.std_velocity_mps) << k;
      EXPECT_LT(*frame.std_velocity_mps, 0.02);                  // the sixth frame is short
      EXPECT_NEAR(*frame.distance_m, range_m / 2, 0.0006) << k;  // 4 ps
    }
    EXPECT_LT(std::abs(drift_ppm), 1e-4);
    frames.resize(5);
    const Spread by_table = spread_of(frames);
    for (const std::string sigma_ps : {"60", "80", "100", "130", "160"}) {
      auto by_gaussian = replay(
          write_config("gaussian", input, found, R"(,"pulse":{"sigma_ps":)" + sigma_ps + "}"));
      by_gaussian.resize(5);
      const Spread spread = spread_of(by_gaussian);
      EXPECT_LT(by_table.measured_mm, spread.measured_mm) << sigma_ps;
      EXPECT_LT(by_table.published_mm, spread.published_mm) << sigma_ps;
    }
  }
}

// With the pattern and the table of the pulse that a calibration at each level finds.
TEST_F(RealRecordings, QutagFramesAreTheSameAtEveryVectorLevel) {
  use("qutag_sync_t2.ptu");
  if (IsSkipped()) return;
  write_nominal();
  const std::string nominal = write_config("nominal_config.json", "1", "nominal.json");
  const std::string found = folder.path("found.json");
  const std::string config =
      write_config("found_config.json", "1", found, R"(,"pulse":{"shape":"tabulated"})");
  std::string pattern, frames;
  for (const VectorLevel level : runnable_vector_levels()) {
    ::setenv("SPLID_VECTOR_LEVEL", vector_level_name(level), 1);
    const ProgramResult calibrated =
        run_program({"calibrate", recording, "--config", nominal, "--output", found, "--force"});
    ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
    std::istringstream lines(run_program({"replay", recording, "--config", config, "--json"}).out);
    std::string here;
    for (std::string line; std::getline(lines, line);) here += repeatable(line) + "\n";
    if (level == VectorLevel::generic) {
      pattern = test::file_text(found);
      frames = here;
    }
    EXPECT_FALSE(here.empty());
    EXPECT_EQ(test::file_text(found), pattern) << vector_level_name(level);
    EXPECT_EQ(here, frames) << vector_level_name(level);
  }
  ::unsetenv("SPLID_VECTOR_LEVEL");
}

// Every n-th photon, all syncs: what a darker target leaves. T2 records with the highest bit set
// are no photons.
void write_thinned(const std::string& from, const std::string& to, std::size_t n) {
  std::vector<std::byte> bytes = test::file_bytes(from);
  std::size_t out = parse_ptu_header(bytes, true).value().header_bytes;
  std::size_t photons = 0;
  for (std::size_t at = out; at + ptu_record_bytes <= bytes.size(); at += ptu_record_bytes) {
    const bool is_photon = (bytes[at + 3] & std::byte{0x80}) == std::byte{0};
    if (is_photon && photons++ % n != 0) continue;
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), ptu_record_bytes,
                bytes.begin() + static_cast<std::ptrdiff_t>(out));
    out += ptu_record_bytes;
  }
  std::ofstream(to, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(out));
}

// Four pulses that are even but for 20 to 60 ps: a few tens of photons a frame cannot tell the four
// ranges apart, and a quarter of the frames are wrong; a thousand can.
TEST_F(RealRecordings, QutagFramesOfFewPhotonsAreNotSureOfTheirRange) {
  use("qutag_sync_t2.ptu");
  if (IsSkipped()) return;
  constexpr double range_m = 12512.626e-12 * 299792458 / 2;
  write_nominal();
  const std::string found = folder.path("found.json");
  const ProgramResult calibrated =
      run_program({"calibrate", recording, "--config", write_config("nominal", "1", "nominal.json"),
                   "--output", found});
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
  const std::string whole = recording;
  recording = folder.path("thinned.ptu");
  const std::string config = write_config(
      "thinned", "1", found, R"(,"pulse":{"shape":"tabulated"},"frame":{"length_ms":10})");
  for (const std::size_t n : {34U, 10U, 2U}) {
    write_thinned(whole, recording, n);
    int ok = 0, wrong = 0, wrong_ok = 0;
    for (const FrameMessage& frame : replay(config)) {
      if (!frame.distance_m || frame.status == FrameStatus::incomplete) continue;
      ASSERT_TRUE(frame.range_odds_nats);
      const bool is_ok = frame.status == FrameStatus::ok;
      const bool is_wrong = std::abs(*frame.distance_m - range_m / 2) > 0.05;
      ok += is_ok ? 1 : 0;
      wrong += is_wrong ? 1 : 0;
      wrong_ok += is_wrong && is_ok ? 1 : 0;
    }
    EXPECT_EQ(wrong_ok, 0) << n;
    EXPECT_GE(wrong, n == 34 ? 3 : 0);
    if (n == 34) {
      EXPECT_EQ(ok, 0);
    } else if (n == 2) {
      EXPECT_EQ(ok, 28);
    }
  }
}

// Its two inputs see the same four pulses, the second one 2,052 ps earlier: together they look like
// eight, until they have delays of their own.
TEST_F(RealRecordings, QutagInputsHaveADelayEach) {
  use("qutag_sync_t2.ptu");
  if (IsSkipped()) return;
  write_nominal();
  const std::string found = folder.path("found.json");
  const ProgramResult together =
      run_program({"calibrate", recording, "--config",
                   write_config("both", "[1,2]", "nominal.json"), "--output", found});
  ASSERT_EQ(together.exit_code, 0) << together.err;
  EXPECT_NE(together.err.find("8 pulses"), std::string::npos) << together.err;
  EXPECT_NE(together.err.find("\"delays_ps\": [0.0, -2051."), std::string::npos) << together.err;
  const ProgramResult aligned =
      run_program({"calibrate", recording, "--config",
                   write_config("aligned", R"([1,2],"delays_ps":[0,-2051.9])", "nominal.json"),
                   "--output", found, "--force"});
  ASSERT_EQ(aligned.exit_code, 0) << aligned.err;
  EXPECT_NE(aligned.err.find("4 pulses"), std::string::npos) << aligned.err;
  EXPECT_EQ(aligned.err.find("delays_ps"), std::string::npos) << aligned.err;
  // Four pulses 3,128 ps apart to 60 ps are told apart by some hundred photons.
  EXPECT_NE(aligned.err.find("random, 4 pulses"), std::string::npos) << aligned.err;
  EXPECT_NE(aligned.err.find("hardest to tell from the right delay: "), std::string::npos);
  for (const FrameMessage& frame :
       replay(write_config("measured", R"([1,2],"delays_ps":[0,-2051.9])", found,
                           R"(,"pulse":{"shape":"tabulated"})"))) {
    EXPECT_NE(frame.status, FrameStatus::no_target);
  }
}

// The same of a recording that a clone can make for itself, whose truth is known.
class MadeRecordings : public RealRecordings {};

TEST_F(MadeRecordings, FramesOfTwoInputsMeasureASourceAtRest) {
  recording = folder.path("made.ptu");
  test::LaserRecording::write(recording);
  constexpr double range_m = test::LaserRecording::period_ps * 1e-12 * 299792458 / 2;
  write_nominal();
  const std::string found = folder.path("found.json");
  const ProgramResult together =
      run_program({"calibrate", recording, "--config",
                   write_config("both", "[1,2]", "nominal.json"), "--output", found});
  ASSERT_EQ(together.exit_code, 0) << together.err;
  EXPECT_NE(together.err.find("8 pulses"), std::string::npos) << together.err;
  EXPECT_NE(together.err.find("\"delays_ps\": [0.0, -205"), std::string::npos) << together.err;
  const std::string inputs = R"([1,2],"delays_ps":[0,-2052])";
  const ProgramResult aligned =
      run_program({"calibrate", recording, "--config",
                   write_config("aligned", inputs, "nominal.json"), "--output", found, "--force"});
  ASSERT_EQ(aligned.exit_code, 0) << aligned.err;
  EXPECT_NE(aligned.err.find("4 pulses"), std::string::npos) << aligned.err;
  EXPECT_NE(aligned.err.find("target at rest"), std::string::npos) << aligned.err;
  const Pattern pattern = pattern_from_json(test::file_text(found), found);
  expect_tailed(pattern);

  const auto frames =
      replay(write_config("found", inputs, found, R"(,"pulse":{"shape":"tabulated"})"));
  ASSERT_EQ(frames.size(), 6U);
  for (std::size_t k = 0; k < 5; ++k) {  // the recording ends within the sixth
    const FrameMessage& frame = frames[k];
    EXPECT_EQ(frame.status, FrameStatus::ok) << k;
    ASSERT_TRUE(frame.sync && frame.sync->period_ps && frame.sync->jitter_ps);
    EXPECT_NEAR(*frame.sync->period_ps, test::LaserRecording::period_ps, 0.005);
    EXPECT_NEAR(*frame.sync->jitter_ps, test::LaserRecording::sync_jitter_ps, 2);
    ASSERT_TRUE(frame.velocity_mps && frame.std_velocity_mps && frame.distance_m);
    EXPECT_LT(std::abs(*frame.velocity_mps), 4 * *frame.std_velocity_mps) << k;
    // In the middle of the range, to 4 ps.
    EXPECT_NEAR(std::remainder(*frame.distance_m - range_m / 2, range_m), 0, 0.0006) << k;
  }
}

TEST_F(RealRecordings, HydraHarpWithoutSyncsSaysSo) {
  use("hydraharp400_t2_hbt.ptu");
  if (IsSkipped()) return;
  const ProgramResult checked = run_program({"check", recording});
  ASSERT_EQ(checked.exit_code, 0) << checked.err;
  for (const char* fact :
       {"409,482", "159,298", "224,721", "25,463", "8584904 ps", "999986166686 ps"}) {
    EXPECT_NE(checked.out.find(fact), std::string::npos) << fact << "\n" << checked.out;
  }

  folder.write("pattern.json", R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline",)"
                               R"("unambiguous_delay_ps":3780000,"segments":[{"period_ps":3780000,)"
                               R"("pulse_times_ps":[0],"amplitudes":[1],"repeats":0}]})");
  const auto frames = replay(write_config("config.json", "[0,1]", "pattern.json"));
  ASSERT_EQ(frames.size(), 20U);
  std::uint64_t photons = 0;
  for (const FrameMessage& frame : frames) {
    EXPECT_EQ(frame.status, FrameStatus::no_sync);
    EXPECT_FALSE(frame.valid());
    EXPECT_FALSE(frame.distance_m.has_value());
    photons += frame.photons.value_or(0);
  }
  EXPECT_EQ(photons, 159298U + 224721U);
  EXPECT_EQ(frames[0].start_ps, 8584904);
}

}  // namespace
}  // namespace splid
