#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "tests/fuzz/estimator_settings.hpp"

namespace splid::test::fuzz_estimator {
namespace {

TEST(FuzzSeeds, EverySettingOfTheEstimatorHasACase) {
  std::array<int, setting_count> cases{};
  for (const auto& entry :
       std::filesystem::directory_iterator(SPLID_SOURCE_DIR "/tests/fuzz/corpus/estimator")) {
    std::ifstream in(entry.path(), std::ios::binary);
    ++cases.at(static_cast<std::size_t>(in.get()) % setting_count);
  }
  for (std::size_t i = 0; i < setting_count; ++i) {
    EXPECT_GT(cases.at(i), 0) << "no case of tests/fuzz/corpus/estimator has setting " << i;
  }
}

}  // namespace
}  // namespace splid::test::fuzz_estimator
