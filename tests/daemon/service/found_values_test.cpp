#include "daemon/service/found_values.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace splid {
namespace {

FrameMessage frame_with(double distance_m, double velocity_mps, FrameStatus status) {
  FrameMessage frame;
  frame.status = status;
  frame.distance_m = distance_m;
  frame.velocity_mps = velocity_mps;
  frame.std_distance_m = 0.00057;
  frame.std_velocity_mps = 0.042;
  return frame;
}

TEST(FoundValues, MedianAndSpreadOfTheValidFrames) {
  FoundValues found;
  EXPECT_EQ(found.in_words(), "no frame has a distance");
  for (int i = 0; i <= 100; ++i)
    found.take(frame_with(280 + 0.1 * i, -1 + 0.02 * i, FrameStatus::ok));
  found.take(frame_with(1e6, 1e6, FrameStatus::no_target));
  found.take(FrameMessage{});
  EXPECT_EQ(
      found.in_words(),
      "distance 285.00000 m (median; 90 % of 101 frames: 280.50000 to 289.50000 m; +- 0.57 mm "
      "a frame); velocity +0.000 m/s (median; 90 %: -0.900 to +0.900 m/s; +- 4.2 cm/s a "
      "frame)");
}

TEST(FoundPixels, FramesByStatusAndTheNearestAndFarthestPixel) {
  FoundPixels found;
  EXPECT_EQ(found.in_words(), "");
  const auto take = [&](const char* name, double distance_m, FrameStatus status) {
    found.take({name, {}, {}, frame_with(distance_m, 0, status)});
  };
  take("dark", 7, FrameStatus::no_target);
  EXPECT_EQ(found.in_words(), "frames of 1 pixels: 1 no_target; no pixel measured");
  for (int i = 0; i <= 1000; ++i) {
    take("wall", 30.25 + (i % 3 - 1), FrameStatus::ok);
    take("plate", 12.5, FrameStatus::ambiguous);
  }
  take("plate", 1e6, FrameStatus::no_target);
  EXPECT_EQ(found.in_words(),
            "frames of 3 pixels: 1,001 ok, 2 no_target, 1,001 ambiguous; 2 measured, from plate at "
            "12.5 m to wall at 30.25 m (medians)");
}

TEST(FoundValues, ASampleOfManyNumbersStaysSmallAndEven) {
  Sample sample;
  for (int i = 0; i < 1'000'000; ++i) sample.add(i);
  EXPECT_NEAR(sample.quantile(0.5), 500'000, 50);
  EXPECT_NEAR(sample.quantile(0.05), 50'000, 50);
  EXPECT_EQ(sample.quantile(0), 0);
}

}  // namespace
}  // namespace splid
