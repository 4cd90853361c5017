#include "daemon/output/path_mean.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace splid {
namespace {

// How many of so many means are sure after so many frames whose excess is that of chance, and of a
// path that is off by `off` deviations.
int sure_means(double off, int frames, int means) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> chance(0, 1);
  int sure = 0;
  for (int n = 0; n < means; ++n) {
    PathMean mean;
    for (int k = 0; k < frames; ++k) {
      FrameMessage message;
      message.path_excess = std::abs(chance(random) + (k % 2 == 0 ? off : -off));
      mean.add(message);
    }
    sure += mean.is_sure() ? 1 : 0;
  }
  return sure;
}

TEST(PathMean, OfChanceAloneIsNeverSure) {
  for (const int frames : {1, 2, 5, 20, 400}) {
    EXPECT_EQ(sure_means(0, frames, 20000 / frames + 1000), 0) << frames;
  }
}

TEST(PathMean, IsSureOfWhatNoFrameShows) {
  EXPECT_EQ(sure_means(2, 40, 100), 100);
  EXPECT_GE(sure_means(1, 300, 100), 95);
  EXPECT_EQ(PathMean().is_sure(), false);
}

TEST(PathMean, KnowsWhatIsMostlyFitted) {
  PathMean mean;
  FrameMessage message;
  message.path_excess = 3;
  mean.add(message);
  EXPECT_FALSE(mean.is_of_bent_paths());
  EXPECT_DOUBLE_EQ(mean.excess(), 3);
  message.acceleration_mps2 = 1;
  mean.add(message);
  mean.add(message);
  EXPECT_TRUE(mean.is_of_bent_paths());
}

}  // namespace
}  // namespace splid
