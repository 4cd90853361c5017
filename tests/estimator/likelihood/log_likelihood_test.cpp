#include "estimator/likelihood/log_likelihood.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "estimator/likelihood/bound.hpp"
#include "estimator/likelihood/information.hpp"
#include "estimator/model/vector_level.hpp"
#include "tests/estimator/likelihood/model_scene.hpp"
#include "tests/support/allocation_count.hpp"

namespace splid::likelihood {
namespace {

using test::FrameMaker;
using test::ModelScene;

// The definition in long double, apart from the product's way: every pulse of every turn at every
// photon, and the light of every pulse in every dead interval.
struct Definition {
  struct Pulse {
    long double time_ns, amplitude;
  };
  const ModelScene& scene;
  std::vector<Pulse> pulses;

  explicit Definition(const ModelScene& of) : scene(of) {
    long double begin = 0;
    for (const PatternSegment& segment : scene.made.pattern.segments) {
      const std::int64_t repeats = scene.made.pattern.segments.size() == 1 ? 1 : segment.repeats;
      for (std::int64_t r = 0; r < repeats; ++r, begin += segment.period_ps * 1e-3L) {
        for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
          pulses.push_back({begin + segment.pulse_times_ps[p] * 1e-3L, segment.amplitudes[p]});
        }
      }
    }
  }
  // When the light that comes at t, tagger's clock, left, in the pattern's clock from the frame's
  // start; g stretches it.
  [[nodiscard]] long double left_ns(const DelayTrack& track, std::int64_t t) const {
    const long double length = scene.frame.end_ps - scene.frame.start_ps;
    const std::int64_t mid = scene.frame.start_ps + (scene.frame.end_ps - scene.frame.start_ps) / 2;
    const long double s = (t - mid) / length;
    const long double since = (t - scene.frame.start_ps) * 1e-3L / scene.folded.scale;
    return since - (track.delay_ns + track.walk_ns * s + track.quadratic_ns * (6 * s * s - 0.5L));
  }
  // The light of a target at t: the density, and the integral up to t of the pulses of its turn and
  // those beside it.
  struct Light {
    long double density = 0, integral = 0;
  };
  [[nodiscard]] Light light(const Model& at, std::size_t k, std::int64_t t) const {
    const Target& target = at.targets[k];
    const long double period = scene.train.period_ns;
    const long double g = target.track.walk_ns / scene.folded.length_ns;
    const long double width = std::exp(static_cast<long double>(at.log_width));
    const long double stretched = scene.folded.scale / (1 - g) / width;
    const long double left = left_ns(target.track, t);
    const auto turn = static_cast<std::int64_t>(std::floor(left / period));
    Light sum;
    for (const Pulse& pulse : pulses) {
      // All pulses of the turns before are over.
      sum.integral += pulse.amplitude * (turn - 1);
      for (std::int64_t n = turn - 1; n <= turn + 1; ++n) {
        const long double x = (left - pulse.time_ns - n * period) * stretched;
        const bool is_far = std::abs(x) > 100 * scene.made.sigma_ns;
        const auto [h, below] = is_far ? std::pair<long double, long double>(0, x > 0 ? 1 : 0)
                                       : shape(static_cast<double>(x));
        sum.density += pulse.amplitude * h / width;
        sum.integral += pulse.amplitude * below;
      }
    }
    return sum;
  }
  [[nodiscard]] std::pair<long double, long double> shape(double x) const {
    double h = 0, d1 = 0, d2 = 0, below = 0;
    scene.shape->evaluate({&x, 1}, {{&h, 1}, {&d1, 1}, {&d2, 1}});
    scene.shape->integrate({&x, 1}, {&below, 1});
    return {h, below};
  }
  [[nodiscard]] long double value(const Model& at) const {
    const Exposure exposure(scene.folded, scene.train);
    long double sum = -static_cast<long double>(at.background_per_ns) * exposure.seen_ns;
    for (std::size_t k = 0; k < at.count; ++k) {
      const long double g = at.targets[k].track.walk_ns / scene.folded.length_ns;
      sum -= at.targets[k].signal_per_pulse * (exposure.amplitude * (1 - g) - hidden(at, k));
    }
    for (const std::int64_t t : scene.frame.photons_ps) {
      long double lambda = at.background_per_ns;
      for (std::size_t k = 0; k < at.count; ++k) {
        lambda += at.targets[k].signal_per_pulse * light(at, k, t).density;
      }
      sum += std::log(lambda);
    }
    return sum;
  }
  [[nodiscard]] long double hidden(const Model& at, std::size_t k) const {
    if (scene.made.dead_time_ns == 0) return 0;
    const auto dead_ps = std::llround(scene.made.dead_time_ns * 1e3);
    std::vector<std::int64_t> detections = scene.frame.before_ps;
    detections.insert(detections.end(), scene.frame.photons_ps.begin(),
                      scene.frame.photons_ps.end());
    std::sort(detections.begin(), detections.end());
    // With a single input a detection ends the dead time of the one before it.
    const bool is_single = scene.made.inputs == 1;
    long double sum = 0;
    for (std::size_t n = 0; n < detections.size(); ++n) {
      std::int64_t end = std::min<std::int64_t>(detections[n] + dead_ps, scene.frame.end_ps);
      if (is_single && n + 1 < detections.size()) end = std::min(end, detections[n + 1]);
      std::int64_t begin = std::max(detections[n], scene.frame.start_ps);
      for (const Loss& loss : scene.frame.losses) {
        if (begin < loss.begin_ps && end > loss.begin_ps) {
          sum += light(at, k, loss.begin_ps).integral - light(at, k, begin).integral;
        }
        if (end > loss.begin_ps) begin = std::max(begin, loss.end_ps);
      }
      if (end > begin) sum += light(at, k, end).integral - light(at, k, begin).integral;
    }
    return sum / scene.made.inputs;
  }
};

double& parameter(Model& model, std::size_t place) {
  if (place == width_place(model.count)) return model.log_width;
  if (place == background_place(model.count)) return model.background_per_ns;
  Target& target = model.targets[place / of_target];
  switch (place % of_target) {
    case delay:
      return target.track.delay_ns;
    case walk:
      return target.track.walk_ns;
    case quadratic:
      return target.track.quadratic_ns;
    default:
      return target.signal_per_pulse;
  }
}

struct Case {
  std::string name;
  FrameMaker made;
  std::vector<FrameMaker> others;
  std::unique_ptr<PulseShape> shape;
  bool width = false, is_table = false;
  std::vector<Loss> losses = {};
  // Nats: with several rates, dead intervals that end in another segment count by the mean rate.
  double off_nats = 0;
};

std::unique_ptr<PulseShape> table() {
  TabulatedPulse table{-400, 50, {}};
  for (int i = 0; i < 30; ++i) {
    const double x = (i - 8) / 2.0;
    table.density.push_back(std::exp(-x * x / (x < 0 ? 2 : 6)));
  }
  return make_tabulated(table);
}

std::vector<Case> cases() {
  const Pattern interleaved = test::interleaved_pattern({180000, 189000}, 3780000);
  Pattern uneven = interleaved;
  double amplitude = 1;
  for (double& a : uneven.segments.front().amplitudes) a = amplitude += 0.05;
  // Pulses 0.4 ns apart, so that photons are near several of them.
  Pattern close = test::interleaved_pattern({180000, 189000}, 3780000);
  PatternSegment& pairs = close.segments.front();
  for (std::size_t p = 0; p < pairs.pulse_times_ps.size(); p += 2) {
    pairs.pulse_times_ps.insert(pairs.pulse_times_ps.begin() + static_cast<std::ptrdiff_t>(p) + 1,
                                pairs.pulse_times_ps[p] + 400);
  }
  pairs.amplitudes.assign(pairs.pulse_times_ps.size(), 0.8);
  const Pattern mrr = test::mrr_pattern({100000, 104000}, 2600000, 2e7);
  FrameMaker dead = ModelScene::maker(uneven);
  dead.length_ms = 0.2;
  dead.signal_per_pulse = 0.5;
  dead.background_per_ns = 5e-3;
  dead.dead_time_ns = 47;
  std::vector<Case> all;
  const auto add = [&](const std::string& name, const FrameMaker& made,
                       std::vector<FrameMaker> others, std::unique_ptr<PulseShape> shape,
                       bool width) {
    all.push_back({name, made, std::move(others), std::move(shape), width,
                   name.find("tabulated") != std::string::npos});
  };
  FrameMaker one = ModelScene::maker(uneven);
  add("one", one, {}, make_gaussian(0.1), false);
  one.acceleration_mps2 = 1e5;
  add("accelerating, of any width", one, {}, make_gaussian(0.1), true);
  add("tabulated, of any width", one, {}, table(), true);
  add("close pulses", ModelScene::maker(close), {}, make_gaussian(0.1), true);
  add("several rates", ModelScene::maker(mrr), {}, make_gaussian(0.1), true);
  add("two that overlap", one, {one.beside(0.03, 4, 0.5)}, make_gaussian(0.1), true);
  add("four", one, {one.beside(0.02, 3, 0.5), one.beside(0.2, 0, 0.4), one.beside(-9, -60, 0.7)},
      make_gaussian(0.1), true);
  add("dead time", dead, {}, make_gaussian(0.1), true);
  FrameMaker other = dead;
  other.inputs = 2;
  other.drift_ppm = 40;
  add("dead time, two inputs, a clock that drifts", other, {}, make_gaussian(0.1), false);
  add("dead time, losses", dead, {}, make_gaussian(0.1), false);
  all.back().losses = {{20'000'000, 30'000'000}, {90'000'010, 120'000'000}};
  other = dead;
  other.pattern = mrr;
  add("dead time, several rates", other, {}, make_gaussian(0.1), false);
  all.back().off_nats = 0.02;
  add("dead time, two, tabulated", dead, {dead.beside(0.03, 4, 0.5)}, table(), true);
  return all;
}

Scope scope_of(const Case& of) {
  return {of.others.size() + 1, of.width ? 4.0 : 1.0, of.made.dead_time_ns > 0};
}

// Value by the definition, gradient and Hessian by its differences. In the units of units_of() the
// information about a parameter is about 1 for each photon that tells it.
TEST(LogLikelihood, IsTheDefinitionInEveryCombination) {
  for (Case& of : cases()) {
    SCOPED_TRACE(of.name);
    ModelScene scene(of.made, of.others, std::move(of.shape), of.losses);
    scene.model.log_width = of.width ? 0.1 : 0;
    LogLikelihood likelihood(*scene.shape, scene.train, scene.folded.size(), scope_of(of));
    likelihood.begin(scene.folded);
    likelihood.collect(scene.model, NearSet::gathered_from);
    const std::size_t targets = scene.model.count;
    const FreeSet free = free_set(targets, 3, of.width);
    Point point;
    likelihood.evaluate(scene.model, free, point);
    const Definition definition(scene);
    const long double value = definition.value(scene.model);
    EXPECT_NEAR(point.value, static_cast<double>(value),
                1e-8 * std::abs(point.value) + of.off_nats);
    const SmallVector units = units_of(scene.model, likelihood.exposure(), 0.1);
    const double scale = static_cast<double>(scene.frame.photons_ps.size());
    // The second derivative of a table's spline steps at its knots.
    const double close = of.is_table ? 1e-3 * scale : 2e-6 * scale;
    for (std::size_t i = 0; i < parameters_of(targets); ++i) {
      if (!free[i]) continue;
      const auto n = static_cast<Eigen::Index>(i);
      const double step = 1e-4 * units[n];
      Model up = scene.model, down = scene.model;
      parameter(up, i) += step;
      parameter(down, i) -= step;
      const auto slope =
          static_cast<double>((definition.value(up) - definition.value(down)) / (2 * step));
      EXPECT_NEAR(point.gradient[n] * units[n], slope * units[n], 2e-6 * scale + of.off_nats)
          << "parameter " << i;
      Point above, below;
      likelihood.evaluate(up, free, above);
      likelihood.evaluate(down, free, below);
      for (Eigen::Index m = 0; m < units.size(); ++m) {
        if (!free[static_cast<std::size_t>(m)]) continue;
        const double curvature = (above.gradient[m] - below.gradient[m]) / (2 * step);
        EXPECT_NEAR(point.hessian(n, m) * units[n] * units[m], curvature * units[n] * units[m],
                    close)
            << "parameters " << i << ", " << m;
        EXPECT_EQ(point.hessian(n, m), point.hessian(m, n));
      }
    }
  }
}

// What a held parameter is held at does not change the others' derivatives.
TEST(LogLikelihood, DerivativesDoNotDependOnWhatElseIsFree) {
  const FrameMaker one = ModelScene::maker(test::interleaved_pattern({180000, 189000}, 3780000));
  ModelScene scene(one, {one.beside(0.05, 4, 0.5)});
  LogLikelihood likelihood(*scene.shape, scene.train, scene.folded.size(), {2, 4, false});
  likelihood.begin(scene.folded);
  likelihood.collect(scene.model, NearSet::gathered_from);
  Point all, few;
  likelihood.evaluate(scene.model, free_set(2, 3, true), all);
  likelihood.evaluate(scene.model, free_set(2, 2), few);
  EXPECT_EQ(all.value, few.value);
  for (const std::size_t i : {place_of(0, delay), place_of(1, walk), place_of(1, signal)}) {
    const auto n = static_cast<Eigen::Index>(i);
    EXPECT_EQ(all.gradient[n], few.gradient[n]);
    EXPECT_EQ(all.hessian(n, 0), few.hessian(n, 0));
  }
}

// (1 - beta) / (1 + beta) in doubles would show no change here at all: v = 10 nm/s.
TEST(LogLikelihood, FeelsTenNanometresASecond) {
  FrameMaker made = ModelScene::maker(test::interleaved_pattern({180000, 189000}, 3780000));
  made.velocity_mps = 0;
  ModelScene scene(made);
  scene.model.targets[0].track.walk_ns = 0;
  LogLikelihood likelihood(*scene.shape, scene.train, scene.folded.size(), {});
  likelihood.begin(scene.folded);
  likelihood.collect(scene.model, NearSet::gathered_from);
  Point at_rest, moved;
  likelihood.evaluate(scene.model, free_set(1, 2), at_rest);
  const double walk_ns = 2e-8 / 299792458.0 * scene.folded.length_ns;
  scene.model.targets[0].track.walk_ns = walk_ns;
  likelihood.evaluate(scene.model, free_set(1, 2), moved);
  EXPECT_NEAR((moved.gradient - at_rest.gradient)[1] / (at_rest.hessian(1, 1) * walk_ns), 1, 0.1);
}

// The information that frames show is on average the information that the bound expects.
TEST(LogLikelihood, ObservedInformationAveragesToTheExpected) {
  FrameMaker made = ModelScene::maker(test::interleaved_pattern({180000, 189000}, 3780000));
  made.velocity_mps = 0;
  made.signal_per_pulse = 0.04;
  SmallMatrix sum = SmallMatrix::Zero(6, 6);
  SmallMatrix expected = SmallMatrix::Zero(6, 6);
  constexpr int frames = 60;
  const PulseTrain train(made.pattern);
  const auto shape = make_gaussian(made.sigma_ns);
  FoldedFrame folded(train, 4000);
  LogLikelihood likelihood(*shape, train, 4000, {});
  const DelayTrack line = {2 * made.distance_m / 0.299792458, 0};
  for (int n = 0; n < frames; ++n) {
    const FrameMaker::Frame frame = made.make(100 + static_cast<std::uint64_t>(n));
    folded.fold(frame.view(), train);
    likelihood.begin(folded);
    Model truth;
    truth.add({{line.delay_ns, 0}, made.signal_per_pulse});
    truth.background_per_ns = made.background_per_ns;
    likelihood.collect(truth, NearSet::gathered_from);
    Point point;
    likelihood.evaluate(truth, free_set(1, 2), point);
    sum -= point.hessian;
    expected += expected_information(*shape, train, likelihood.exposure(), truth);
  }
  // 60 frames of 210 signal photons: the mean curvature scatters by about 1.5 %.
  for (const Eigen::Index i : {0, 1, 3, 5}) {
    for (const Eigen::Index j : {0, 1, 3, 5}) {
      const double scale = std::sqrt(expected(i, i) * expected(j, j));
      EXPECT_NEAR(sum(i, j) / scale, expected(i, j) / scale, 0.06) << i << " " << j;
    }
  }
}

// A single photon far out in a pulse's tail, where a product of eight such intensities underflows.
TEST(LogLikelihood, HoldsWhereIntensitiesUnderflowTogether) {
  FrameMaker made = ModelScene::maker(test::interleaved_pattern({180000, 189000}, 3780000));
  made.background_per_ns = 0;
  ModelScene scene(made);
  scene.model.background_per_ns = 1e-60;
  scene.model.targets[0].track.delay_ns += 0.9;
  LogLikelihood likelihood(*scene.shape, scene.train, scene.folded.size(), {});
  likelihood.begin(scene.folded);
  likelihood.collect(scene.model, NearSet::gathered_from);
  Point point;
  likelihood.evaluate(scene.model, free_set(1, 2), point);
  const auto value = static_cast<double>(Definition(scene).value(scene.model));
  EXPECT_NEAR(point.value, value, 1e-8 * std::abs(value));
}

TEST(LogLikelihood, GivesTheSameBitsAtEachVectorLevelAndAllocatesNothing) {
  const FrameMaker one = ModelScene::maker(test::interleaved_pattern({180000, 189000}, 3780000));
  ModelScene scene(one, {one.beside(0.05, 4, 0.5)});
  std::vector<Point> points;
  for (const VectorLevel level : runnable_vector_levels()) {
    limit_vector_level(level);
    LogLikelihood likelihood(*scene.shape, scene.train, scene.folded.size(), {2, 4, false});
    Point point;
    const std::uint64_t before = test::allocations;
    likelihood.begin(scene.folded);
    likelihood.collect(scene.model, NearSet::gathered_from);
    likelihood.evaluate(scene.model, free_set(2, 3, true), point);
    EXPECT_EQ(test::allocations, before);
    points.push_back(point);
  }
  limit_vector_level(runnable_vector_levels().back());
  for (const Point& point : points) {
    EXPECT_EQ(point.value, points.front().value);
    EXPECT_EQ(point.gradient, points.front().gradient);
    EXPECT_EQ(point.hessian, points.front().hessian);
  }
}

}  // namespace
}  // namespace splid::likelihood
