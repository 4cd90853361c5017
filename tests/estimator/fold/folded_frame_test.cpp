#include "estimator/fold/folded_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker folded_maker() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = 5;
  made.velocity_mps = 42;
  made.drift_ppm = 17;
  return made;
}

TEST(FoldedFrame, PhasesAgreeWithLongDouble) {
  for (const std::int64_t epoch_ps : {std::int64_t{0}, std::int64_t{340000000000000000}}) {
    test::FrameMaker made = folded_maker();
    made.start_ps = epoch_ps;
    const auto frame = made.make(1);
    const PulseTrain train(folded_maker().pattern);
    FoldedFrame folded(train, frame.photons_ps.size());
    folded.fold(frame.view(), train);
    ASSERT_EQ(folded.size(), frame.photons_ps.size());
    for (std::size_t i = 0; i < folded.size(); ++i) {
      const long double since = frame.photons_ps[i] - frame.start_ps;
      const long double turns = since / frame.sync.period_ps;
      const auto phase = static_cast<double>((turns - std::floor(turns)) * 3780);
      ASSERT_NEAR(std::remainder(folded.phase_ns[i] - phase, 3780), 0, 1e-7);
      ASSERT_NEAR(std::remainder(folded.phase_32[i] * 3780.0 * 0x1p-32 - phase, 3780), 0, 2e-6);
      const long double mid = (frame.end_ps - frame.start_ps) / 2;
      ASSERT_NEAR(folded.time_ns[i], static_cast<double>((since - mid) * 1e-3L / (1 + 17e-6L)),
                  1e-8);
    }
    EXPECT_NEAR(folded.scale, 1 + 17e-6, 1e-15);
  }
}

TEST(FoldedFrame, LossesAreNotSeen) {
  auto frame = folded_maker().make(1);
  frame.losses = {{frame.start_ps + 1000000, frame.start_ps + 3000000, -1}};
  const PulseTrain train(folded_maker().pattern);
  FoldedFrame folded(train, frame.photons_ps.size());
  folded.fold(frame.view(), train);
  EXPECT_NEAR(folded.seen_ns, static_cast<double>(frame.end_ps - frame.start_ps) * 1e-3 - 2000,
              1e-6);
}

}  // namespace
}  // namespace splid
