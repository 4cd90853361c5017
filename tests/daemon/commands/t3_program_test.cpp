#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"
#include "tests/support/json_frames.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/t3_recording.hpp"

// A recording in T3 mode through the built program.

namespace splid {
namespace {

using test::as_t3;
using test::run_program;
using test::T3Recording;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class T3Program : public ::testing::Test {
 protected:
  T3Program() {
    config = folder.write("config.json",
                          R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator",)"
                          R"("pace":"max","drift_ppm":40},"pattern":{"file":")" SPLID_SOURCE_DIR
                          R"(/config/patterns/interleaved-180-189.json"})" +
                              std::string(test::small_ring) + "}");
  }
  test::TempFolder folder;
  std::string config;
};

TEST_F(T3Program, ItsFramesAreThoseOfT2ButForWhatT3DoesNotTell) {
  const std::string t2 = folder.path("t2.ptu");
  ASSERT_EQ(
      run_program({"simulate", "--config", config, "--seconds", "0.5", "--output", t2}).exit_code,
      0);
  T3Recording made;
  made.records = as_t3(test::read_back(t2), 128);
  const std::string t3 = folder.write("t3.ptu", made.bytes());
  const auto timed = test::frames_in(
      run_program({"replay", t2, "--config", config, "--no-publish", "--json"}).out);
  const auto result = run_program({"replay", t3, "--config", config, "--no-publish", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("steps of 128 ps, which are coarser than pulses of 100"),
                                Not(HasSubstr("divided")), Not(HasSubstr("fits a record"))));
  const auto counted = test::frames_in(result.out);
  ASSERT_EQ(counted.size(), timed.size());
  for (std::size_t i = 1; i + 1 < counted.size(); ++i) {
    EXPECT_EQ(counted[i].status, FrameStatus::ok) << i;
    EXPECT_FALSE(counted[i].sync.has_value()) << "nothing is known of the syncs";
    ASSERT_TRUE(timed[i].sync.has_value());
    // Half a step of 128 ps is 1 cm, and the frames lie a little beside each other.
    EXPECT_NEAR(*counted[i].distance_m, *timed[i].distance_m, 0.03) << i;
    EXPECT_NEAR(*counted[i].velocity_mps, *timed[i].velocity_mps, 1) << i;
    EXPECT_NEAR(static_cast<double>(*counted[i].photons), static_cast<double>(*timed[i].photons),
                30);
  }
}

TEST_F(T3Program, CheckNamesWhatItCannotSay) {
  T3Recording made;
  made.resolution_s = 16e-12;
  made.divider = 4;
  made.records = {test::t3_photon(1, 100, 0), test::t3_photon(1, 0x7FFF, 1)};
  const std::string fine = run_program({"check", folder.write("fine.ptu", made.bytes())}).out;
  EXPECT_THAT(fine, AllOf(HasSubstr("a PTU recording, T3, record type 0x01010304, 16 ps a tick"),
                          HasSubstr("3780000.000000 ps, as the header has it"),
                          HasSubstr("divided by 4 (HWSync_Divider)"),
                          HasSubstr("fits a record up to 524.288 ns, and syncs come every 3780 ns"),
                          HasSubstr("than a record can say, and count as lost: 1"),
                          Not(HasSubstr("which are coarser"))));
  made.resolution_s = 256e-12;
  made.divider = 1;
  const std::string coarse = run_program({"check", folder.write("coarse.ptu", made.bytes())}).out;
  EXPECT_THAT(coarse, AllOf(HasSubstr("steps of 256 ps, which are coarser than pulses of 100 ps"),
                            Not(HasSubstr("divided")), Not(HasSubstr("fits a record"))));
}

TEST_F(T3Program, AnotherPeriodThanThePatternsIsSaid) {
  T3Recording made;
  made.sync_period_s = 4 * 3.78e-6;
  made.records = {test::t3_photon(1, 100, 0)};
  const std::string file = folder.write("a.ptu", made.bytes());
  const auto result = run_program({"replay", file, "--config", config, "--no-publish", "--json"});
  EXPECT_THAT(result.err, HasSubstr("a sync every 15120000 ps, and the pattern a period of "
                                    "3780000 ps: the syncs were divided, the recorder counted"));
}

TEST_F(T3Program, ItIsNoCalibration) {
  T3Recording made;
  made.records = {test::t3_photon(1, 100, 0)};
  const std::string file = folder.write("a.ptu", made.bytes());
  const auto result =
      run_program({"calibrate", file, "--config", config, "--output", folder.path("pattern.json")});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("counts syncs and does not time them"));
}

}  // namespace
}  // namespace splid
