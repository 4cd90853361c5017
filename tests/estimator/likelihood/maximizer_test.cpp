#include "estimator/likelihood/maximizer.hpp"

#include <gtest/gtest.h>
#include <nlopt.h>

#include <cmath>
#include <vector>

#include "estimator/likelihood/information.hpp"
#include "tests/estimator/likelihood/model_scene.hpp"

namespace splid::likelihood {
namespace {

using test::FrameMaker;
using test::ModelScene;

FrameMaker interleaved() {
  FrameMaker made = ModelScene::maker(test::interleaved_pattern({180000, 189000}, 3780000));
  made.length_ms = 5;
  made.signal_per_pulse = 0.02;
  made.background_per_ns = 5e-4;
  return made;
}

// By another's optimiser (Nelder and Mead's simplex, no derivatives) from the maximum: no place
// nearby is higher.
double highest_nearby(LogLikelihood& likelihood, const Maximum& at, const FreeSet& free) {
  const SmallVector units = units_of(at.model, likelihood.exposure(), 0.1);
  struct Problem {
    LogLikelihood& likelihood;
    const Maximum& at;
    FreeSet free;
    SmallVector units;
    Point point;
    Model moved(const double* x) const {
      Model model = at.model;
      std::size_t n = 0;
      const auto step = [&](std::size_t place) {
        return free[place] ? x[n++] * units[static_cast<Eigen::Index>(place)] : 0;
      };
      for (std::size_t k = 0; k < model.count; ++k) {
        Target& target = model.targets[k];
        target.track.delay_ns += step(place_of(k, delay));
        target.track.walk_ns += step(place_of(k, walk));
        target.track.quadratic_ns += step(place_of(k, quadratic));
        target.signal_per_pulse += step(place_of(k, signal));
      }
      model.log_width += step(width_place(model.count));
      model.background_per_ns += step(background_place(model.count));
      return model;
    }
  } problem{likelihood, at, free, units, {}};
  const auto value = [](unsigned, const double* x, double*, void* data) {
    auto& of = *static_cast<Problem*>(data);
    of.likelihood.evaluate(of.moved(x), of.free, of.point);
    return of.point.value;
  };
  std::vector<double> x(free.count(), 0.0);
  nlopt_opt optimiser = nlopt_create(NLOPT_LN_NELDERMEAD, static_cast<unsigned>(x.size()));
  nlopt_set_max_objective(optimiser, value, &problem);
  nlopt_set_initial_step1(optimiser, 0.05);
  nlopt_set_maxeval(optimiser, 3000);
  double best = 0;
  nlopt_optimize(optimiser, x.data(), &best);
  nlopt_destroy(optimiser);
  return best - likelihood.no_target_nats();
}

struct Wish {
  std::vector<FrameMaker> others;
  std::size_t terms;
  bool width;
};

TEST(Maximizer, ReachesTheMaximumOfEachSetOfFreeParameters) {
  const FrameMaker one = interleaved();
  const std::vector<Wish> wishes = {{{}, 1, false},
                                    {{}, 2, false},
                                    {{}, 3, true},
                                    {{one.beside(0.06, 0, 0.5)}, 2, false},
                                    {{one.beside(0.06, 0, 0.5), one.beside(5, 60, 1)}, 3, true}};
  for (const Wish& wish : wishes) {
    SCOPED_TRACE(::testing::Message() << wish.others.size() << " others, " << wish.terms);
    const ModelScene scene(one, wish.others);
    Maximizer maximizer(*scene.shape, scene.train, scene.folded.size(),
                        {wish.others.size() + 1, wish.width ? 4.0 : 1.0, false});
    const FreeSet free = free_set(scene.model.count, wish.terms, wish.width);
    maximizer.begin(scene.folded);
    const Maximum maximum = maximizer.maximize(scene.model, {free});
    ASSERT_TRUE(maximum.has_covariance);
    EXPECT_EQ(maximum.stop, Stop::gain_small);
    const double best = highest_nearby(maximizer.likelihood(), maximum, free);
    EXPECT_NEAR(best, maximum.gain_nats, 1e-4);
  }
}

// A start without rates finds them; held parameters stay as they were, and have no deviation.
TEST(Maximizer, HoldsWhatIsHeld) {
  const ModelScene scene(interleaved());
  Maximizer maximizer(*scene.shape, scene.train, scene.folded.size(), {1, 4, false});
  maximizer.begin(scene.folded);
  Model start = scene.model;
  start.targets[0].signal_per_pulse = 0;
  start.background_per_ns = 0;
  start.log_width = 0.05;
  const Maximum maximum = maximizer.maximize(start, {free_set(1, 1)});
  const Target& target = maximum.model.targets[0];
  EXPECT_EQ(maximum.model.log_width, 0.05);
  EXPECT_EQ(target.track.walk_ns, start.targets[0].track.walk_ns);
  EXPECT_EQ(target.track.quadratic_ns, start.targets[0].track.quadratic_ns);
  for (const Eigen::Index held : {1, 2, 4}) EXPECT_EQ(maximum.covariance(held, held), 0);
  EXPECT_NEAR(target.signal_per_pulse, 0.02, 5 * std::sqrt(maximum.covariance(3, 3)));
  EXPECT_NEAR(maximum.model.background_per_ns, 5e-4, 5 * std::sqrt(maximum.covariance(5, 5)));
}

// Published deviations are those of the errors: 1,000 frames of every parameter together.
TEST(Maximizer, DeviationsAreThoseOfTheErrors) {
  FrameMaker made = interleaved();
  made.length_ms = 1;
  made.signal_per_pulse = 0.01;
  constexpr int frames = 400;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  const PulseTrain train(made.pattern);
  const auto shape = make_gaussian(0.1);
  Maximizer maximizer(*shape, train, 4000, {1, 4, false});
  FoldedFrame folded(train, 4000, 3);
  for (int n = 0; n < frames; ++n) {
    const FrameMaker::Frame frame = made.make(static_cast<std::uint64_t>(n) + 1);
    folded.fold(frame.view(), train);
    maximizer.begin(folded);
    const double beta = made.velocity_mps / 299792458.0;
    const DelayTrack truth = {2 * made.distance_m / 0.299792458 / (1 + beta),
                              2 * beta / (1 + beta) * folded.length_ns, 0};
    Model start;
    start.add({truth, 0});
    const Maximum found = maximizer.maximize(start, {free_set(1, 3, true)});
    ASSERT_TRUE(found.has_covariance);
    const DelayTrack& track = found.model.targets[0].track;
    const Eigen::Vector3d off(track.delay_ns - truth.delay_ns, track.walk_ns - truth.walk_ns,
                              found.model.log_width);
    const SmallMatrix& C = found.covariance;
    squares += off.cwiseAbs2().cwiseQuotient(Eigen::Vector3d(C(0, 0), C(1, 1), C(4, 4)));
  }
  // The mean of 400 squares of normal numbers scatters by 0.07.
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(squares[i] / frames, 1, 0.28);
}

TEST(Maximizer, GivesUpWhatIsSurelyLower) {
  const ModelScene scene(interleaved());
  Maximizer maximizer(*scene.shape, scene.train, scene.folded.size(), {});
  maximizer.begin(scene.folded);
  Maximizer::Aim aim = {free_set(1, 2)};
  const Maximum top = maximizer.maximize(scene.model, aim);
  aim.to_beat_nats = top.gain_nats + 100;
  const Maximum beaten = maximizer.maximize(scene.model, aim);
  EXPECT_EQ(beaten.stop, Stop::beaten);
  EXPECT_LE(beaten.gain_nats, top.gain_nats);
  EXPECT_FALSE(beaten.has_covariance);
}

// 6,000 photons near the track: put together on the way, and each by itself at the end.
TEST(Maximizer, BrightTargetsEndWithEachPhotonByItself) {
  FrameMaker bright = interleaved();
  bright.length_ms = 10;
  bright.signal_per_pulse = 0.055;
  const ModelScene scene(bright);
  Maximizer maximizer(*scene.shape, scene.train, scene.folded.size(), {});
  maximizer.begin(scene.folded);
  const FreeSet free = free_set(1, 2);
  const Maximum fit = maximizer.maximize(scene.model, {free});
  EXPECT_FALSE(maximizer.likelihood().near().gathers());
  EXPECT_NEAR(maximizer.judge(fit.model, free).gain_nats, fit.gain_nats, 1e-6);
}

// Very many photons are put together in cells. A width that is fitted then knows of the cells.
TEST(Maximizer, GatheredPhotonsTellTheWidth) {
  FrameMaker bright = interleaved();
  bright.signal_per_pulse = 0.5;
  const ModelScene scene(bright);
  Maximizer maximizer(*scene.shape, scene.train, scene.folded.size(), {1, 4, false});
  maximizer.begin(scene.folded);
  const Maximum found = maximizer.maximize(scene.model, {free_set(1, 2, true)});
  ASSERT_TRUE(maximizer.likelihood().near().gathers());
  // 26,000 photons know the width to 0.4 %; what the cells take off would be 0.07 %.
  EXPECT_NEAR(found.model.log_width, 0, 4 * std::sqrt(found.covariance(4, 4)));
  Model cells = found.model;
  Point point;
  maximizer.likelihood().evaluate(cells, free_set(1, 2, true), point);
  EXPECT_LT(point.gradient[4] * std::sqrt(found.covariance(4, 4)), -0.1);
}

// Without background, b goes to 0 and nothing else waits for it.
TEST(Maximizer, ReachesTheMaximumWithoutBackground) {
  FrameMaker dark = interleaved();
  dark.background_per_ns = 0;
  const ModelScene scene(dark);
  Maximizer maximizer(*scene.shape, scene.train, scene.folded.size(), {});
  maximizer.begin(scene.folded);
  Model start = scene.model;
  start.background_per_ns = 0;
  start.targets[0].track.delay_ns += 0.1;
  const Maximum found = maximizer.maximize(start, {free_set(1, 2)});
  EXPECT_EQ(found.stop, Stop::gain_small);
  EXPECT_LT(found.model.background_per_ns * scene.folded.seen_ns, 1e-5);
  ASSERT_TRUE(found.has_covariance);
  const DelayTrack truth = scene.track_of(dark);
  EXPECT_NEAR(found.model.targets[0].track.delay_ns, truth.delay_ns,
              4 * std::sqrt(found.covariance(0, 0)));
  // Every photon is signal: the maximum of S is their number.
  EXPECT_NEAR(found.model.targets[0].signal_per_pulse * maximizer.likelihood().exposure().amplitude,
              static_cast<double>(scene.folded.size()), 0.01);
}

// Frames of no photon, one photon and few photons give a status and no NaN.
TEST(Maximizer, FewPhotonsGiveNumbers) {
  for (const double photons : {0.0, 1.0, 3.0, 20.0}) {
    FrameMaker few = interleaved();
    few.signal_per_pulse = 1e-9;
    few.background_per_ns = photons / 5e6;
    const ModelScene scene(few);
    if (scene.folded.size() == 0) continue;
    Maximizer maximizer(*scene.shape, scene.train, scene.folded.size(), {1, 4, false});
    maximizer.begin(scene.folded);
    Model start = scene.model;
    start.targets[0].track.delay_ns = scene.folded.phase_ns[0];
    start.targets[0].track.walk_ns = 0;
    start.targets[0].signal_per_pulse = 0;
    const Maximum found = maximizer.maximize(start, {free_set(1, 3, true)});
    EXPECT_NE(found.stop, Stop::not_run);
    EXPECT_TRUE(std::isfinite(found.gain_nats));
    EXPECT_TRUE(std::isfinite(found.model.targets[0].track.delay_ns));
    EXPECT_GE(found.model.targets[0].signal_per_pulse, 0);
    EXPECT_GE(found.model.background_per_ns, 0);
  }
}

}  // namespace
}  // namespace splid::likelihood
