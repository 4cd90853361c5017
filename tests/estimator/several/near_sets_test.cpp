#include "estimator/several/near_sets.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

struct NearSetsScene {
  test::FrameMaker made;
  test::FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  std::vector<CombWindow> windows;

  static test::FrameMaker maker() {
    test::FrameMaker made;
    made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
    made.length_ms = 10;
    return made;
  }
  explicit NearSetsScene(std::uint64_t seed = 1)
      : made(maker()),
        frame(made.make(seed)),
        train(made.pattern),
        folded(train, frame.photons_ps.size()),
        windows(comb_windows(train, -2, 2)) {
    folded.fold(frame.view(), train);
  }
  const NearSet& about(NearSets& sets, DelayLine line) const {
    return sets.about(folded, windows, train, line, 0.4);
  }
};

TEST(NearSets, KeepsWhatServesALine) {
  const NearSetsScene scene;
  NearSets sets(3, 100'000, 100'000);
  const NearSet& first = scene.about(sets, {100, 0});
  const NearSet& second = scene.about(sets, {100.5, 0});
  EXPECT_NE(&first, &second);
  EXPECT_EQ(&first, &scene.about(sets, {100.1, 0}));
  EXPECT_EQ(first.line.delay_ns, 100);
  // The nearest one, by the ends of the lines.
  EXPECT_EQ(&second, &scene.about(sets, {100.3, 0}));
  EXPECT_EQ(&second, &scene.about(sets, {100.6, 0.5}));
  const NearSet& third = scene.about(sets, {100.0, 0.9});
  EXPECT_NE(&third, &first);
  EXPECT_NE(&third, &second);
}

// What was asked for last is collected anew last.
TEST(NearSets, GivesUpWhatNobodyAskedFor) {
  const NearSetsScene scene;
  NearSets sets(2, 100'000, 100'000);
  const NearSet& first = scene.about(sets, {100, 0});
  const NearSet& second = scene.about(sets, {200, 0});
  EXPECT_EQ(&first, &scene.about(sets, {100, 0}));
  EXPECT_EQ(&second, &scene.about(sets, {300, 0}));
  EXPECT_EQ(second.line.delay_ns, 300);
  EXPECT_EQ(&first, &scene.about(sets, {100, 0}));
  EXPECT_EQ(&second, &scene.about(sets, {200, 0}));
  EXPECT_EQ(second.line.delay_ns, 200);
}

TEST(NearSets, ForgetsAFrame) {
  const NearSetsScene scene, other(2);
  NearSets sets(2, 100'000, 100'000);
  const NearSet& of_first = scene.about(sets, {100, 0});
  const std::vector<double> before = of_first.residual_ns;
  EXPECT_EQ(scene.about(sets, {100, 0}).residual_ns, before);
  EXPECT_EQ(other.about(sets, {100, 0}).residual_ns, before);  // nobody said that it is another
  sets.forget();
  EXPECT_NE(other.about(sets, {100, 0}).residual_ns, before);
}

}  // namespace
}  // namespace splid
