#include "drivers/awg/waveform_samples.hpp"

#include <gtest/gtest.h>

#include <string>

namespace splid::awg {
namespace {

const Model& small_awg = models()[0];
const Model& m8190a_awg = models()[2];

// Two periods of eight; the second pulse runs over into the next period.
WaveformPlan small_plan() {
  WaveformPlan plan;
  plan.samples_per_period = 8;
  plan.periods = 2;
  plan.pulse_starts = {2, 7};
  plan.pulse_samples = 2;
  plan.marker_samples = 3;
  return plan;
}

TEST(WaveformSamples, BytePairsArePinned) {
  const std::string up = "\x7f", down = "\x81", on = "\x01", off = std::string(1, '\0');
  const std::string period =
      up + on + down + on + up + on + up + off + down + off + down + off + down + off + up + off;
  EXPECT_EQ(waveform_samples(small_plan(), small_awg, true, 0, 16), period + period);
  const std::string falling = waveform_samples(small_plan(), small_awg, false, 0, 8);
  EXPECT_EQ(falling.substr(0, 4), down + on + up + on);
}

TEST(WaveformSamples, WordsArePinned) {
  // 8191 * 4 = 32764 = 0x7ffc, its negative 0x8004; the marker is bit 0.
  EXPECT_EQ(waveform_samples(small_plan(), m8190a_awg, true, 0, 4),
            "\xfd\x7f\x05\x80\xfd\x7f\xfc\x7f");
}

TEST(WaveformSamples, PartsAreThoseOfTheWhole) {
  const std::string whole = waveform_samples(small_plan(), small_awg, true, 0, 16);
  for (std::int64_t first = 0; first < 16; ++first) {
    for (std::int64_t count = 1; first + count <= 16; ++count) {
      EXPECT_EQ(waveform_samples(small_plan(), small_awg, true, first, count),
                whole.substr(2 * first, 2 * count))
          << first << " " << count;
    }
  }
}

}  // namespace
}  // namespace splid::awg
