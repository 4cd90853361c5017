#include "daemon/stream/sync_diagnosis.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

TEST(SyncDiagnosis, SaysByHowMuchThePeriodIsOff) {
  EXPECT_EQ(in_words(SyncDiagnosis{3'780'000, 3'770'000.0, 13'000, 50}),
            "the syncs come at multiples of 3770 ns, but the pattern's period is 3780 ns (-10 ns "
            "or -2646 ppm off): give the pattern that the generator plays at /pattern/file, or "
            "calibrate it");
  // No oscillator is so far off that ppm would tell, and 264,522.3 of them are no multiple.
  EXPECT_NE(in_words(SyncDiagnosis{25'000'000'000, 94'510.0, 13'000, 50})
                .find("(-24999905.5 ns off): give"),
            std::string::npos);
}

TEST(SyncDiagnosis, SaysWhereOneIsAMultipleOfTheOther) {
  EXPECT_NE(in_words(SyncDiagnosis{3'780'000, 189'000.1, 13'000, 50})
                .find("the pattern takes 20 of them"),
            std::string::npos);
  EXPECT_NE(
      in_words(SyncDiagnosis{3'780'000, 7'560'000.0, 13'000, 50}).find("one sync takes 2 of them"),
      std::string::npos);
}

TEST(SyncDiagnosis, SaysWhereNothingFits) {
  const std::string text = in_words(SyncDiagnosis{3'780'000, {}, 40, 50});
  EXPECT_NE(text.find("40 syncs in 50 ms"), std::string::npos);
  EXPECT_NE(text.find("/channels/sync"), std::string::npos);
}

}  // namespace
}  // namespace splid
