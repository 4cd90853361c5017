#include "estimator/search/joint_start.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double start_ns_per_m = 2 / 0.299792458;

// A frame of 20 ms with [P]'s pattern and targets of thrice its signal, and what the search and the
// likelihood know of it when the joint fit begins.
struct StartScene {
  std::vector<test::FrameMaker> makers;
  test::FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  std::unique_ptr<PulseShape> shape;
  TargetSearch search;
  JointLikelihood likelihood;
  TargetClaims claims;
  TargetSearch::Search first;
  JointParameters alone;

  static std::vector<test::FrameMaker> make(const std::vector<double>& offs_ns,
                                            const std::vector<double>& velocities_mps) {
    std::vector<test::FrameMaker> made(offs_ns.size());
    for (std::size_t k = 0; k < made.size(); ++k) {
      made[k].pattern = test::interleaved_pattern({180000, 189000}, 3780000);
      made[k].length_ms = 20;
      made[k].distance_m += offs_ns[k] / start_ns_per_m;
      made[k].velocity_mps = velocities_mps[k];
      made[k].signal_per_pulse = 40e-4;
    }
    return made;
  }
  StartScene(const std::vector<double>& offs_ns, const std::vector<double>& velocities_mps)
      : makers(make(offs_ns, velocities_mps)),
        frame(makers.front().make_with({makers.begin() + 1, makers.end()}, 5)),
        train(makers.front().pattern),
        folded(train, frame.photons_ps.size()),
        shape(make_gaussian(0.1)),
        search(train, *shape,
               {2e7, 30, 22, {3780, 30, 0.1}, 7, Effort::balanced, true, false, true},
               frame.photons_ps.size()),
        likelihood(*shape, train, frame.photons_ps.size(), 0.4),
        claims(*shape, train, likelihood),
        first{{}, search.no_peaks()} {
    folded.fold(frame.view(), train);
    first.fit = search.find(folded).value();
    search.keep_peaks(first.peaks);
    alone.add({first.fit.parameters.line, first.fit.parameters.signal_per_pulse});
    alone.background_per_ns = first.fit.parameters.background_per_ns;
    likelihood.collect(folded, alone);
    claims.begin({folded, train});
  }
  [[nodiscard]] JointStart::Guess guess(std::size_t most) {
    JointStart start(search, *shape, train, likelihood, claims, 42, most);
    return start.guess({folded, train}, alone, first, true);
  }
  // How far the nearest of the guess's targets is from each true one, in ns.
  [[nodiscard]] std::vector<double> off_ns(const JointStart::Guess& guess) const {
    std::vector<double> offs;
    for (const test::FrameMaker& truth : makers) {
      double nearest = 1e9;
      for (std::size_t k = 0; k < guess.at.count; ++k) {
        const double off = guess.at.targets.at(k).line.delay_ns - truth.distance_m * start_ns_per_m;
        nearest = std::min(nearest, std::abs(std::remainder(off, 3780)));
      }
      offs.push_back(nearest);
    }
    return offs;
  }
};

TEST(JointStart, HasAllThatStandApart) {
  StartScene scene({0, 7, -113.3}, {20, 20, 20});
  const JointStart::Guess guess = scene.guess(3);
  ASSERT_EQ(guess.at.count, 3U);
  EXPECT_FALSE(guess.is_row);
  for (const double off : scene.off_ns(guess)) EXPECT_LT(off, 0.05);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(guess.at.targets.at(k).signal_per_pulse, 40e-4, 6e-4);
  }
  EXPECT_NEAR(guess.at.background_per_ns, 1.75e-4, 2e-5);
  EXPECT_EQ(guess.least_nats.at(0), 0);
  EXPECT_GT(guess.least_nats.at(1), 0.5 * scene.first.fit.gain_nats);
}

TEST(JointStart, HasTheRowInPlaceOfTheBest) {
  for (const std::vector<double>& offs_ns : {std::vector{0.0, 0.3}, {0, 0.4, 0.8}, {0, 0.5, 1.0}}) {
    StartScene scene(offs_ns, {20, 20, 20});
    const JointStart::Guess guess = scene.guess(4);
    ASSERT_EQ(guess.at.count, offs_ns.size());
    EXPECT_TRUE(guess.is_row);
    for (const double off : scene.off_ns(guess)) EXPECT_LT(off, 0.05);
    // The first of them is where the best target of the search was.
    const auto& begin = guess.at.targets.front();
    EXPECT_LT(scene.claims.apart_widths(begin, scene.alone.targets.front()), 2.5);
  }
}

// More high peaks than there may be targets are the places where combs meet, or leave open which of
// them are meant; what moves otherwise has not been looked beside.
TEST(JointStart, LeavesPeaksInDoubtToTheSearch) {
  StartScene three({0, 7, -113.3}, {20, 20, 20});
  EXPECT_EQ(three.guess(2).at.count, 1U);
  StartScene meeting({0, 63}, {20, 20});
  EXPECT_EQ(meeting.guess(2).at.count, 1U);
  StartScene other_velocity({0, 7}, {20, 45});
  EXPECT_EQ(other_velocity.guess(2).at.count, 1U);
  StartScene lone({0}, {20});
  EXPECT_EQ(lone.guess(4).at.count, 1U);
}

}  // namespace
}  // namespace splid
