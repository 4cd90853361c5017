#include "estimator/search/joint_start.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
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
                                            const std::vector<double>& velocities_mps,
                                            const std::vector<double>& signals,
                                            const Pattern& pattern) {
    std::vector<test::FrameMaker> made(offs_ns.size());
    for (std::size_t k = 0; k < made.size(); ++k) {
      made[k].pattern = pattern;
      made[k].length_ms = 20;
      made[k].distance_m += offs_ns[k] / start_ns_per_m;
      made[k].velocity_mps = velocities_mps[k];
      made[k].signal_per_pulse = signals.empty() ? 40e-4 : signals[k];
    }
    return made;
  }
  StartScene(const std::vector<double>& offs_ns, const std::vector<double>& velocities_mps,
             const std::vector<double>& signals = {}, std::uint64_t seed = 5,
             const Pattern& pattern = test::interleaved_pattern({180000, 189000}, 3780000))
      : makers(make(offs_ns, velocities_mps, signals, pattern)),
        frame(makers.front().make_with({makers.begin() + 1, makers.end()}, seed)),
        train(makers.front().pattern),
        folded(train, frame.photons_ps.size()),
        shape(make_gaussian(0.1)),
        search(train, *shape,
               {2e7, 30, 22, {3780, 30, 0.1}, 7, Effort::balanced, true, false, true},
               frame.photons_ps.size()),
        likelihood(*shape, train, frame.photons_ps.size(), 0.4),
        claims(*shape, train, likelihood, 1e-3),
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

// A comb of one pulse has no shoulders. What moves as the best target is another target.
TEST(JointStart, HasAllOfACombOfOnePulse) {
  StartScene scene({0, 7, -113.3}, {20, 20, 20}, {1600e-4, 1600e-4, 1400e-4}, 5,
                   test::periodic_pattern(3780000));
  const JointStart::Guess guess = scene.guess(3);
  ASSERT_EQ(guess.at.count, 3U);
  for (const double off : scene.off_ns(guess)) EXPECT_LT(off, 0.05);
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

// Three that are hardly seen to stand apart, and two whose light is spread alike: three at +-e and
// 0 are spread as two at +-e sqrt(2/3).
TEST(JointStart, HasThreeWhereTwoDoNotFit) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    StartScene three({0, 0.3, 0.6}, {20, 20, 20}, {}, seed);
    const JointStart::Guess guess = three.guess(3);
    ASSERT_EQ(guess.at.count, 3U) << seed;
    for (const double off : three.off_ns(guess)) EXPECT_LT(off, 0.05) << seed;
    EXPECT_EQ(three.guess(2).at.count, 2U) << seed;
    for (const double off_ns : {0.45, 0.49}) {
      StartScene two({0, off_ns}, {20, 20}, {60e-4, 60e-4}, seed);
      EXPECT_EQ(two.guess(3).at.count, 2U) << seed;
    }
  }
}

// Closer together than others are told apart, since they cross.
TEST(JointStart, HasTwoWhoseLinesCross) {
  for (const double off_ns : {0.0, 0.08}) {
    StartScene scene({0, off_ns}, {20, 24});
    const JointStart::Guess guess = scene.guess(2);
    ASSERT_EQ(guess.at.count, 2U);
    EXPECT_TRUE(guess.do_part);
    const auto& [a, b] = std::tie(guess.at.targets[0].line, guess.at.targets[1].line);
    EXPECT_NEAR(std::abs(b.travel_ns - a.travel_ns), 2 * 4 / 299792458.0 * 2e7, 0.2);
    EXPECT_NEAR(std::abs(b.delay_ns - a.delay_ns), off_ns, 0.06);
    EXPECT_LT(scene.claims.apart_widths(guess.at.targets[0], guess.at.targets[1]),
              TargetClaims::closest_widths);
  }
}

// The best target is often the first or the last of a row, and has the light of the others in its
// reach for a part of the frame alone. The row's travels are those of the targets all the same.
TEST(JointStart, HasTheRowsTravel) {
  for (const double first_mps : {20.0, -13.0}) {
    StartScene scene({0, 0.4, 0.8}, {first_mps, first_mps, first_mps});
    for (const double turned_ns : {-0.3, 0.0, 0.3}) {
      JointParameters& alone = scene.alone;
      alone.targets[0].line = {scene.makers[0].distance_m * start_ns_per_m,
                               2 * first_mps / 299792458.0 * 2e7 + turned_ns};
      scene.likelihood.collect(scene.folded, alone);
      const JointStart::Guess guess = scene.guess(3);
      ASSERT_EQ(guess.at.count, 3U) << turned_ns;
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(guess.at.targets.at(k).line.travel_ns, 2 * first_mps / 299792458.0 * 2e7, 0.05)
            << turned_ns;
      }
    }
  }
}

// The photons of a twentieth 6 widths from a bright target are spread as those of a pair of equals
// 2.6 widths apart, which it does not start as.
TEST(JointStart, HasAWeakOneWhereItsLightIs) {
  for (const double off_ns : {-0.6, 0.4, 0.5}) {
    StartScene scene({0, off_ns}, {20, 20}, {160e-4, 8e-4});
    const JointStart::Guess guess = scene.guess(2);
    ASSERT_EQ(guess.at.count, 2U) << off_ns;
    EXPECT_TRUE(guess.is_row);
    for (const double off : scene.off_ns(guess)) EXPECT_LT(off, 0.1) << off_ns;
    EXPECT_NEAR(guess.at.targets.at(0).signal_per_pulse, 160e-4, 10e-4);
    EXPECT_NEAR(guess.at.targets.at(1).signal_per_pulse, 8e-4, 5e-4);
  }
}

// The light of two targets whose combs meet has four peaks. Two of them make the other two.
TEST(JointStart, HasTheTwoWhoseCombsMeetAtAllOtherPeaks) {
  for (const double off_ns : {9.0, 63.0}) {
    StartScene scene({0, off_ns}, {20, 20});
    const CombMeetings& meetings = scene.search.meetings();
    const double truth_ns = scene.makers[0].distance_m * start_ns_per_m;
    for (const std::size_t most : {2U, 4U}) {
      const JointStart::Guess guess = scene.guess(most);
      ASSERT_EQ(guess.at.count, 2U) << off_ns;
      EXPECT_FALSE(guess.is_row);
      const double a = guess.at.targets[0].line.delay_ns, b = guess.at.targets[1].line.delay_ns;
      const std::vector<double> offs = scene.off_ns(guess);
      const bool are_true = offs[0] < 0.05 && offs[1] < 0.05;
      EXPECT_TRUE(are_true || (meetings.do_meet(truth_ns, truth_ns + off_ns, a) &&
                               meetings.do_meet(truth_ns, truth_ns + off_ns, b)))
          << off_ns;
      EXPECT_FALSE(meetings.find(a, b).delays_ns().empty());
    }
  }
}

// Half of the pulses of two targets that are a period apart are the same. Each alone seems half
// as bright again as it is, and its own pulses keep a fifth of what it gains then.
TEST(JointStart, HasTwoThatShareHalfOfTheirPulses) {
  for (const double off_ns : {180.0, -378.0}) {
    StartScene scene({0, off_ns}, {20, 20});
    const JointStart::Guess guess = scene.guess(2);
    ASSERT_EQ(guess.at.count, 2U) << off_ns;
    for (const double off : scene.off_ns(guess)) EXPECT_LT(off, 0.05) << off_ns;
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(guess.at.targets.at(k).signal_per_pulse, 40e-4, 6e-4) << off_ns;
    }
    EXPECT_NEAR(guess.at.background_per_ns, 1.75e-4, 2e-5);
    const double best_nats = scene.first.fit.gain_nats;
    EXPECT_NEAR(guess.least_nats.at(1), 0.24 * best_nats, 0.03 * best_nats);
    const JointStart::Guess row = scene.guess(3);
    EXPECT_EQ(row.at.count, 2U);
  }
}

// More high peaks than there may be targets leave open which of them are meant; what moves
// otherwise has not been looked beside.
TEST(JointStart, LeavesPeaksInDoubtToTheSearch) {
  StartScene three({0, 7, -113.3}, {20, 20, 20});
  EXPECT_EQ(three.guess(2).at.count, 1U);
  StartScene other_velocity({0, 7}, {20, 45});
  EXPECT_EQ(other_velocity.guess(2).at.count, 1U);
  StartScene lone({0}, {20});
  EXPECT_EQ(lone.guess(4).at.count, 1U);
}

// What is left of a scene's frame, target by target.
struct RestOfScene {
  StartScene& scene;
  FoldedFrame rest{scene.train, scene.folded.size()};
  std::vector<std::uint8_t> stays = std::vector<std::uint8_t>(scene.folded.size());
  JointParameters known = scene.alone;
  std::array<DelayLine, most_targets> lines = {known.targets.front().line};

  explicit RestOfScene(StartScene& of) : scene(of) { take_out(); }

  void take_out() {
    scene.likelihood.collect(scene.folded, known);
    scene.likelihood.thin({scene.folded, scene.train}, known, stays);
    rest.take_some(stays, JointLikelihood::stays_without_any, scene.folded);
  }
  // Takes what was found out too, which is the kth of the scene.
  void expect_is(const std::optional<Fit>& found, std::size_t k) {
    ASSERT_TRUE(found) << k;
    const FrameParameters& at = found->parameters;
    const test::FrameMaker& truth = scene.makers[k];
    EXPECT_NEAR(at.line.delay_ns, truth.distance_m * start_ns_per_m, 0.05) << k;
    EXPECT_NEAR(at.line.travel_ns, 2 * truth.velocity_mps / 299792458.0 * 2e7, 0.1) << k;
    known.add({at.line, at.signal_per_pulse});
    lines.at(known.count - 1) = at.line;
    take_out();
  }
  [[nodiscard]] std::span<const DelayLine> first_lines(std::size_t count) const {
    return std::span(lines).first(count);
  }
};

// A target that is no rival of the best one is not climbed to. It is seen, and found where it was
// seen once the better ones have been taken out.
TEST(TargetSearch, FindsOneThatWasSeen) {
  StartScene scene({0, 7, -50}, {20, 95, -60}, {40e-4, 24e-4, 13e-4});
  RestOfScene left(scene);
  left.expect_is(scene.search.find_more(left.rest, Effort::balanced, 22, 1), 1);
  TargetSearch::Peaks peaks = scene.search.no_peaks();
  scene.search.keep_peaks(peaks);
  const auto seen = peaks.seen.best_beside(left.first_lines(2));
  ASSERT_TRUE(seen);
  EXPECT_EQ(peaks.odds.gain_near(seen->line, 0.2, {}), 0);
  left.expect_is(scene.search.find_seen(left.rest, peaks, left.first_lines(2)), 2);
  // Nothing is seen beside all three, and nothing is left where the third has been.
  EXPECT_FALSE(scene.search.find_seen(left.rest, peaks, left.first_lines(3)));
  EXPECT_FALSE(scene.search.find_seen(left.rest, peaks, left.first_lines(2)));
}

// Of three, the last moves otherwise, and has more signal than the second.
TEST(TargetSearch, FindsOneThatMovesAsTheOthersDo) {
  StartScene scene({0, 7, -50}, {20, 20, 95}, {40e-4, 13e-4, 16e-4});
  RestOfScene left(scene);
  const TargetSearch::Peaks& peaks = scene.first.peaks;
  left.expect_is(scene.search.find_alike(left.rest, peaks, left.first_lines(1)), 1);
  EXPECT_FALSE(scene.search.find_alike(left.rest, peaks, left.first_lines(2)));
  left.expect_is(scene.search.find_more(left.rest, Effort::balanced, 22, 2), 2);
  // The known ones do not move alike any more.
  left.known.count = 1;
  left.take_out();
  EXPECT_TRUE(scene.search.find_alike(left.rest, peaks, left.first_lines(1)));
  EXPECT_FALSE(scene.search.find_alike(left.rest, peaks, left.first_lines(3)));
}

// In 20 ms a path that differs by 12 m/s shows a part of its light among the delays of the known
// travel, and travels that differ by 50 m/s are looked at.
TEST(TargetSearch, FindsOneThatMovesMuchAsTheOthersDo) {
  for (const double faster_mps : {-45.0, -12.0, 5.0, 12.0}) {
    StartScene scene({0, 7}, {90, 90 + faster_mps}, {40e-4, 9e-4});
    RestOfScene left(scene);
    left.expect_is(scene.search.find_alike(left.rest, scene.first.peaks, left.first_lines(1)), 1);
  }
  StartScene scene({0, 7}, {20, 90}, {40e-4, 9e-4});
  const RestOfScene left(scene);
  EXPECT_FALSE(scene.search.find_alike(left.rest, scene.first.peaks, left.first_lines(1)));
}

// A bright target that moves otherwise shows a part of its path among the delays of the known one's
// travel, and so do its 40 shoulders. With a look at that travel alone the first of these frames
// would have a part of the path, and the second a shoulder.
TEST(TargetSearch, TakesNoPartOfAnotherPathForOneThatMovesAlike) {
  for (const auto& [off_ns, signal, faster_mps] :
       {std::tuple{-50.0, 40e-4, 50.0}, {300.0, 20e-4, 53.0}}) {
    StartScene scene({0, off_ns}, {20, 20 + faster_mps}, {60e-4, signal},
                     static_cast<std::uint64_t>(2 * faster_mps));
    RestOfScene left(scene);
    const auto found = scene.search.find_alike(left.rest, scene.first.peaks, left.first_lines(1));
    if (found) left.expect_is(found, 1);
  }
}

// The path of a target that crosses that of the known one passes by it too, in a part of the frame.
TEST(TargetSearch, TakesNoPathThatCrossesForOneBeside) {
  const Pattern pattern = test::periodic_pattern(3780000);
  int beside = 0;
  for (const double faster_mps : {40.0, 60.0, 80.0, -70.0}) {
    StartScene scene({0, 1.5}, {20, 20 + faster_mps}, {0.16, 0.11}, 5, pattern);
    const RestOfScene left(scene);
    const auto found = scene.search.find_beside(left.rest, left.first_lines(1), 10);
    // Within reach of the look it may be found as it is.
    const double travel_ns = 2 * scene.makers[1].velocity_mps / 299792458.0 * 2e7;
    if (found) {
      EXPECT_NEAR(found->parameters.line.travel_ns, travel_ns, 0.2) << faster_mps;
    }
    StartScene alike({0, 1}, {20, 20}, {0.16, 0.11}, 5, pattern);
    const RestOfScene rest(alike);
    beside += alike.search.find_beside(rest.rest, rest.first_lines(1), 10) ? 1 : 0;
  }
  EXPECT_EQ(beside, 4);
}

}  // namespace
}  // namespace splid
