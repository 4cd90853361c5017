#include "estimator/search/range_odds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double pi = 3.14159265358979323846;

// What the frames of a scene came to, target and light drawn anew for each.
struct Tally {
  int ok = 0, ambiguous = 0, none = 0;
  int wrong_ok = 0, wrong_ambiguous = 0;
  double expected_wrong = 0;  // by the odds
};

struct Trials {
  test::FrameMaker made;
  double least_signal, most_signal;  // drawn evenly by logarithm
  int frames;
  EstimatorOptions options = {};
};

Tally run(Trials trials) {
  test::FrameMaker& made = trials.made;
  const double circle_ns = made.pattern.unambiguous_delay_ps * 1e-3;
  FrameEstimator estimator(made.pattern, {.sigma_ps = made.sigma_ns * 1e3}, {}, trials.options,
                           made.length_ms, 1'500'000);
  std::mt19937_64 random(77);
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<>(from, to)(random);
  };
  Tally tally;
  for (int n = 0; n < trials.frames; ++n) {
    const double delay_ns = uniform(0, circle_ns);
    made.distance_m = delay_ns * 1e-9 * 299792458 / 2;
    made.velocity_mps = uniform(-150, 150);
    made.signal_per_pulse =
        std::exp(uniform(std::log(trials.least_signal), std::log(trials.most_signal)));
    const Estimate e = estimator.estimate(made.make(random()).view());
    if (!e.has_values) {
      ++tally.none;
      continue;
    }
    const double off_ns = std::remainder(e.delay_ns - delay_ns, circle_ns);
    // Three photons close in time leave the mid-frame's delay to some ns, and say so.
    const bool wrong = std::abs(off_ns) > 5 * std::max(made.sigma_ns, e.std_delay_ns);
    const bool is_ok = e.status == FrameStatus::ok;
    ++(is_ok ? tally.ok : tally.ambiguous);
    (is_ok ? tally.wrong_ok : tally.wrong_ambiguous) += wrong ? 1 : 0;
    tally.expected_wrong += 1 / (1 + std::exp(e.range_odds_nats));
    EXPECT_EQ(is_ok, e.range_odds_nats >= odds_at_risk_nats(trials.options.range_risk));
  }
  return tally;
}

// As many pulses evenly in the period, each off by up to so much; calibration says random.
Pattern uneven_comb(std::size_t pulses, double period_ps, double most_off_ps) {
  Pattern pattern = test::random_pattern(period_ps, pulses, 0, 1);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<> off_ps(-most_off_ps, most_off_ps);
  for (std::size_t p = 0; p < pulses; ++p) {
    pattern.segments[0].pulse_times_ps[p] =
        static_cast<double>(p) * period_ps / static_cast<double>(pulses) +
        (p > 0 ? off_ps(random) : 0);
  }
  return pattern;
}

// 80 MHz with one sync in eight pulses: eight ranges 1.873 m apart.
test::FrameMaker even_maker(double length_ms) {
  test::FrameMaker made;
  made.pattern = uneven_comb(8, 99950, 3);
  made.length_ms = length_ms;
  made.sigma_ns = 0.06;
  made.background_per_ns = 1e-5;
  return made;
}

test::FrameMaker few_photons(const Pattern& pattern, double length_ms, double background_per_ns) {
  test::FrameMaker made;
  made.pattern = pattern;
  made.length_ms = length_ms;
  made.background_per_ns = background_per_ns;
  return made;
}

const Pattern interleaved = test::interleaved_pattern({180000, 189000}, 3780000);
const Pattern random_40 = test::random_pattern(3780000, 40, 9000, 5);

TEST(RangeOdds, OfAnEvenCombAreNone) {
  const Tally tally = run({even_maker(1), 0.001, 0.01, 200});
  EXPECT_EQ(tally.ok, 0);
  EXPECT_EQ(tally.ambiguous, 200);
  // Pure chance between eight would have 175.
  EXPECT_GT(tally.wrong_ambiguous, 130);
  EXPECT_NEAR(tally.expected_wrong, tally.wrong_ambiguous, 30);
}

// 3 ps are a twentieth of a width: 2,000 photons gain N/2 (3/60)^2 = 2.5 nats.
TEST(RangeOdds, OfANearlyEvenCombGrowWithItsPhotons) {
  test::FrameMaker made = even_maker(1);
  made.pattern = uneven_comb(8, 99950, 20);
  const Tally dark = run({made, 0.001, 0.001, 100});  // 80 photons
  const Tally bright = run({made, 0.1, 0.1, 20});     // 8,000
  EXPECT_GT(dark.ambiguous, 90);
  EXPECT_EQ(bright.ok, 20);
  EXPECT_EQ(dark.wrong_ok + bright.wrong_ok, 0);
}

// Of frames with odds of x nats 1 / (1 + e^x) are wrong: at few photons, whatever the pattern.
TEST(RangeOdds, SayHowManyFramesAreWrong) {
  const Pattern rates = test::mrr_pattern({180000, 189000}, 3780000, 1e8);
  const Tally some[] = {run({few_photons(interleaved, 0.02, 1e-4), 0.03, 0.1, 2000}),
                        run({few_photons(interleaved, 0.1, 1e-3), 0.012, 0.03, 2000}),
                        run({few_photons(random_40, 0.1, 1e-3), 0.004, 0.03, 1500}),
                        run({few_photons(rates, 0.1, 1e-3), 0.006, 0.03, 1000}),
                        run({few_photons(uneven_comb(4, 12512.6, 60), 5, 1e-4), 1e-5, 5e-4, 300})};
  double expected = 0;
  int wrong = 0;
  for (const Tally& tally : some) {
    EXPECT_EQ(tally.wrong_ok, 0);
    EXPECT_GT(tally.ok, tally.ambiguous / 3);
    expected += tally.expected_wrong;
    wrong += tally.wrong_ambiguous;
  }
  EXPECT_GT(wrong, 80);
  EXPECT_NEAR(wrong, expected, 4 * std::sqrt(expected));
}

// One pulse a period, and two or three photons of it.
TEST(RangeOdds, HoldForThreePhotons) {
  const Tally tally =
      run({few_photons(test::periodic_pattern(3780000), 0.5, 1e-5), 0.005, 0.04, 2000});
  EXPECT_GT(tally.ok, 500);
  EXPECT_EQ(tally.wrong_ok, 0);
}

TEST(RangeOdds, LoseNoFrameOfTheExperiment) {
  for (const Pattern& pattern : {interleaved, random_40}) {
    for (const double signal : {2e-4, 13.5e-4}) {
      const Tally tally = run({few_photons(pattern, 50, 1.75e-4), signal, signal, 20});
      EXPECT_EQ(tally.ok, 20) << signal;
      EXPECT_EQ(tally.wrong_ok, 0);
    }
  }
}

TEST(RangeOdds, OfAMillionPhotonsOfAnEvenCombAreNone) {
  test::FrameMaker made = even_maker(50);
  const Tally tally = run({made, 0.1, 0.1, 2});  // 400,000
  EXPECT_EQ(tally.wrong_ok, 0);
  made.pattern = uneven_comb(8, 99950, 0);
  EXPECT_EQ(run({made, 0.1, 0.1, 2}).ok, 0);
}

// What is followed is weighed as well; a range that may be wrong is not followed.
TEST(RangeOdds, OfAFollowedTargetCountItsCopies) {
  test::FrameMaker made = even_maker(1);
  made.signal_per_pulse = 0.01;
  FrameEstimator estimator(made.pattern, {.sigma_ps = 60}, {}, {.tracked = true}, 1, 100'000);
  TargetTrack track;
  for (std::uint64_t n = 0; n < 5; ++n) {
    const Estimate e = estimator.estimate(made.make(n).view(), &track);
    EXPECT_EQ(e.status, FrameStatus::ambiguous);
    EXPECT_FALSE(track.valid);
  }
  made = few_photons(interleaved, 10, 1.75e-4);
  FrameEstimator other(made.pattern, {}, {}, {.tracked = true}, 10, 100'000);
  for (std::uint64_t n = 0; n < 5; ++n) {
    const Estimate e = other.estimate(made.make(n).view(), &track);
    EXPECT_EQ(e.status, FrameStatus::ok);
    EXPECT_GT(e.range_odds_nats, 20);
    EXPECT_LT(e.range_odds_nats, 0.8 * e.significance_nats);  // half of the pulses fit elsewhere
    EXPECT_EQ(track.followed, n);
  }
}

// In mode `ambiguous` they are those of the delay within the pattern's own.
TEST(RangeOdds, InModeAmbiguousAreOfTheDelayWithin) {
  test::FrameMaker made = few_photons(uneven_comb(40, 3780000, 0), 1, 1e-3);
  made.pattern.mode = Mode::ambiguous;
  made.pattern.unambiguous_delay_ps = 94500;
  made.signal_per_pulse = 0.02;
  FrameEstimator estimator(made.pattern, {}, {}, {}, 1, 100'000);
  const Estimate e = estimator.estimate(made.make(1).view());
  EXPECT_EQ(e.status, FrameStatus::ambiguous);
  EXPECT_GT(e.range_odds_nats, 50);
}

// [P]'s method starts the random mode at v = 0 and ends beside the target at 140 m/s.
TEST(RangeOdds, OfThePapersMethodAreWeighedAgainstTheWholePlane) {
  const Tally tally =
      run({few_photons(random_40, 10, 1.75e-4), 13.5e-4, 13.5e-4, 20, {.method = Method::paper}});
  EXPECT_EQ(tally.wrong_ok, 0);
}

// The posterior of a frame of a few photons, summed over delays, range walks and signals point by
// point. Prior: delays and range walks alike, signals up to the best peak's.
class Summed {
 public:
  Summed(const FrameView& view, const Pattern& pattern, double sigma_ns, double max_walk_ns)
      : period_ns_(pattern.segments[0].period_ps * 1e-3),
        sigma_ns_(sigma_ns),
        max_walk_ns_(max_walk_ns) {
    const auto length_ps = static_cast<long double>(view.end_ps - view.start_ps);
    const std::int64_t mid_ps = view.mid_ps();
    for (const std::int64_t photon_ps : view.photons_ps) {
      position_.push_back(static_cast<long double>(photon_ps - mid_ps) / length_ps);
      phase_ns_.push_back(static_cast<long double>(photon_ps - view.start_ps) * 1e-3L);
    }
    for (const double at_ps : pattern.segments[0].pulse_times_ps) times_ns_.push_back(at_ps * 1e-3);
  }

  // Log of the mass near best over the mass elsewhere.
  [[nodiscard]] double odds_nats(double delay_ns, double walk_ns, double most_share) const {
    const long double step_ns = sigma_ns_ / 4;
    long double here = 0, elsewhere = 0;
    for (long double delay = 0; delay < period_ns_; delay += step_ns) {
      for (long double walk = -max_walk_ns_; walk <= max_walk_ns_; walk += 2 * step_ns) {
        const bool same = std::abs(std::remainder(delay - delay_ns, period_ns_)) < 5 * sigma_ns_ &&
                          std::abs(walk - walk_ns) < 10 * sigma_ns_;
        (same ? here : elsewhere) += over_signals(delay, walk, most_share);
      }
    }
    return static_cast<double>(std::log(here / elsewhere));
  }

 private:
  [[nodiscard]] long double over_signals(long double delay, long double walk,
                                         long double most_share) const {
    std::vector<long double> ratio(position_.size());
    for (std::size_t k = 0; k < ratio.size(); ++k) {
      for (const double time : times_ns_) {
        const long double off =
            std::remainder(phase_ns_[k] - delay - walk * position_[k] - time, period_ns_) /
            sigma_ns_;
        ratio[k] += std::exp(-off * off / 2);
      }
      ratio[k] *= period_ns_ / (static_cast<long double>(times_ns_.size()) * sigma_ns_ *
                                std::sqrt(2 * static_cast<long double>(pi)));
    }
    constexpr int shares = 24;
    long double sum = 0;
    for (int n = 0; n < shares; ++n) {
      const long double share = most_share * (n + 0.5L) / shares;
      long double product = 1;
      for (const long double r : ratio) product *= 1 + share * (r - 1);
      sum += product;
    }
    return sum;
  }

  long double period_ns_, sigma_ns_, max_walk_ns_;
  std::vector<long double> position_, phase_ns_;
  std::vector<double> times_ns_;
};

TEST(RangeOdds, AgreeWithTheSumOverTheWholePlane) {
  test::FrameMaker made;
  made.pattern = uneven_comb(4, 80000, 15000);  // two lags nearly alike
  made.length_ms = 0.1;                         // 1,250 periods
  made.distance_m = 5;
  double worst_off = 0;
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    made.signal_per_pulse = 0.0006 + 0.0001 * static_cast<double>(seed);  // 3 to 9 photons
    made.background_per_ns = 1e-4;
    const auto frame = made.make(seed);
    FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 1000);
    const Estimate e = estimator.estimate(frame.view());
    if (!e.has_values) continue;
    const double max_walk_ns = 2 * 150 / 299792458.0 * 1e5;
    const double walk_ns = 2 * e.velocity_mps / 299792458.0 * 1e5;
    const double share = e.signal_per_pulse * 4 * 1250 / static_cast<double>(e.photons);
    const double sum = Summed(frame.view(), made.pattern, 0.1, max_walk_ns)
                           .odds_nats(e.delay_ns, walk_ns, std::min(1.0, share));
    // Beyond 20 nats all ranges are sure.
    worst_off =
        std::max(worst_off, std::abs(std::min(e.range_odds_nats, 20.0) - std::min(sum, 20.0)));
    ++compared;
  }
  ASSERT_GE(compared, 5);
  EXPECT_LT(worst_off, 2);
}

// Delay 0.01 of 100 ns, range walk 0.02 of 20 ns, signal 0.1 of 1; both uncorrelated.
likelihood::Maximum peak_at(double delay_ns, double gain_nats) {
  likelihood::Maximum fit;
  fit.model = likelihood::model_of({delay_ns}, 1, 1);
  fit.gain_nats = gain_nats;
  fit.covariance = SmallMatrix::Zero(6, 6);
  fit.covariance.diagonal() << 1e-4, 4e-4, 0, 1e-2, 0, 1;
  fit.has_covariance = true;
  return fit;
}

TEST(RangeOdds, AgainstChanceAreTheGainLessWhatWasSearched) {
  RangeOdds odds({100, 10, 0.1});
  const likelihood::Maximum best = peak_at(50, 40);
  odds.add(best);
  const double volume = std::pow(2 * pi, 1.5) * 0.01 / 100 * 0.02 / 20 * 0.1;
  const double alone = 40 + std::log(volume);
  EXPECT_NEAR(odds.of(best), alone, 1e-9);
  // Its own foot and a place far below are no rivals; an equal one leaves nothing.
  odds.add(peak_at(50.4, 39));
  odds.add({20, 0}, 0);
  EXPECT_NEAR(odds.of(best), alone, 1e-4);
  odds.add(peak_at(70, 40));
  odds.add(peak_at(70.01, 39.9));  // the same once more
  EXPECT_NEAR(odds.of(best), 0, 1e-6);
  // As near around the circle's end as over it; another velocity is another range.
  EXPECT_NEAR(odds.of(peak_at(150, 40)), 0, 1e-6);
  likelihood::Maximum moving = peak_at(50, 45);
  moving.model.targets[0].track.walk_ns = 3;
  odds.add(moving);
  EXPECT_NEAR(odds.of(best), -5, 0.01);
  odds.clear();
  EXPECT_NEAR(odds.of(best), alone, 1e-9);
}

// What is faster than was looked for needs so much more, but no more than 20 nats.
TEST(RangeOdds, OfWhatIsTooFastAreLower) {
  RangeOdds odds({100, 10, 0.1});
  likelihood::Maximum fast = peak_at(50, 40);
  const double slow_nats = odds.of(fast);
  fast.model.targets[0].track.walk_ns = 10;
  EXPECT_NEAR(odds.of(fast), slow_nats - std::log(2), 1e-6);
  fast.model.targets[0].track.walk_ns = 10.08;  // four deviations
  EXPECT_NEAR(odds.of(fast), slow_nats + std::log(0.5 * std::erfc(4 / std::sqrt(2))), 1e-3);
  fast.model.targets[0].track.walk_ns = 15;
  EXPECT_NEAR(odds.of(fast), slow_nats - 20, 1e-6);
}

TEST(RangeOdds, NameTheStrongestPlaceBesideKnownTargets) {
  RangeOdds odds({3780, 50, 0.1});
  EXPECT_FALSE(odds.best_beside({}));
  odds.add({100, 1}, 50);
  odds.add({3779.9, 1}, 40);
  odds.add({100, 9}, 30);
  const DelayTrack known[] = {{100.2, 1.1}, {0.1, 1}};
  EXPECT_EQ(odds.best_beside({})->gain_nats, 50);
  EXPECT_EQ(odds.best_beside(std::span(known).first(1))->gain_nats, 40);
  EXPECT_EQ(odds.best_beside(known)->line.walk_ns, 9);
}

TEST(RangeOdds, OfARiskAreItsLogit) {
  EXPECT_EQ(odds_at_risk_nats(0.5), 0);
  EXPECT_NEAR(odds_at_risk_nats(1e-3), 6.9068, 1e-4);
}

}  // namespace
}  // namespace splid
