#include "estimator/checks/residual_map.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/checks/map_fit.hpp"
#include "tests/estimator/checks/judged_frames.hpp"
#include "tests/estimator/likelihood/model_scene.hpp"

namespace splid::checks {
namespace {

using test::FoldedMaker;
using test::interleaved_maker;
using test::ModelScene;

constexpr double map_sigma_ns = 0.1;

TEST(ResidualMap, CountsEachPhotonAtItsOffsetAndPart) {
  FoldedMaker made = interleaved_maker();
  made.track = {3775.3, -4.7, 0.8};
  FoldedFrame frame(made.train, 100000);
  made.make(frame, 3);
  const auto shape = make_gaussian(map_sigma_ns);
  ResidualMap map(made.train, *shape, frame.size());
  map.fill(frame, made.track);
  ASSERT_EQ(map.cells(), 32U);
  std::vector<double> counts(map_parts * most_cells), by_pulse(40);
  double elsewhere = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double share = frame.time_ns[i] / frame.length_ns;
    bool is_near = false;
    for (std::size_t p = 0; p < 40; ++p) {
      const double offset = std::remainder(
          frame.phase_ns[i] - made.track.at(share) - made.train.segments.front().comb.times_ns[p],
          3780.0);
      if (std::abs(offset) >= 1.6) continue;
      is_near = true;
      std::size_t cell = 0;
      while (map.edge_ns(cell + 1) <= offset) ++cell;
      counts[static_cast<std::size_t>((share + 0.5) * 32) * most_cells + cell] += 1;
      if (std::abs(offset) < 0.2) by_pulse[p] += 1;
    }
    if (!is_near) elsewhere += 1;
  }
  double apart = 0, sum = map.elsewhere();
  for (std::size_t j = 0; j < map_parts; ++j) {
    for (std::size_t i = 0; i < map.cells(); ++i) {
      apart += std::abs(map.part(j)[i] - counts[j * most_cells + i]);
      sum += map.part(j)[i];
    }
  }
  EXPECT_LE(apart, 2);  // photons on the border of two cells, which are rounded to a millionth
  EXPECT_EQ(map.elsewhere(), elsewhere);
  EXPECT_EQ(sum, static_cast<double>(frame.size()));
  for (std::size_t p = 0; p < 40; ++p) EXPECT_NEAR(map.by_pulse()[p], by_pulse[p], 1) << p;
}

// The photons of all pulses that a cell has in a part of the frame, by quadrature over the offset,
// of a pulse about `path` whose width is `wide` times that of `shape`.
double integrated(const PulseShape& shape, double first_ns, double last_ns, double path_ns,
                  double wide) {
  constexpr int steps = 400;
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const double x = first_ns + (last_ns - first_ns) * (k + 0.5) / steps;
    sum += std::exp(shape.log_h((x - path_ns) / wide)) / wide;
  }
  return sum * (last_ns - first_ns) / steps;
}

std::unique_ptr<PulseShape> lopsided() {
  TabulatedPulse table;
  table.first_ps = -200, table.step_ps = 20;
  for (int k = 0; k < 60; ++k) {
    table.density.push_back(std::exp(-0.5 * std::pow((k - 10) / (k < 10 ? 3.0 : 9.0), 2)));
  }
  return make_tabulated(table);
}

TEST(MapBasis, IsOfOrthogonalPolynomialsOfLegendre) {
  const MapBasis basis;
  for (std::size_t k = 0; k < map_parts; ++k) {
    for (std::size_t l = 0; l <= k; ++l) {
      double product = 0;
      for (std::size_t j = 0; j < map_parts; ++j) product += basis.at(k, j) * basis.at(l, j);
      const double expected = k == l ? MapBasis::mean_square(k) * map_parts : 0;
      EXPECT_NEAR(product, expected, 1e-12) << k << ' ' << l;
    }
    if (k > 3) continue;
    for (std::size_t j = 0; j < map_parts; ++j) {
      const double u = (2.0 * static_cast<double>(j) + 1) / map_parts - 1;
      EXPECT_NEAR(basis.at(k, j), std::legendre(static_cast<unsigned>(k), u), 0.01)
          << k << ' ' << j;
    }
  }
}

TEST(MapFit, ExpectsWhatQuadratureSays) {
  const FoldedMaker made = interleaved_maker();
  FoldedFrame frame(made.train, 100000);
  made.make(frame, 3);
  for (const bool is_table : {false, true}) {
    const auto shape = is_table ? lopsided() : make_gaussian(map_sigma_ns);
    ResidualMap map(made.train, *shape, frame.size());
    map.fill(frame, made.track);
    const PulseTable pulse(*shape);
    MapFit fit(map, made.train, pulse);
    SeenLight seen;
    seen.of_part[7] = 0.25;
    fit.begin(frame, made.truth(), 0, seen);
    Member member;
    member.of({Shape::path, 0}) = 0.05, member.of({Shape::path, 1}) = -0.04;
    member.of({Shape::width, 0}) = 0.2, member.of({Shape::light, 0}) = 0.1;
    member.of({Shape::dark, 0}) = -0.3;
    std::array<double, most_cells> photons{};
    fit.expect(member, 7, photons);
    const double u = 15.0 / 32 - 1;
    for (std::size_t i = 0; i < map.cells(); ++i) {
      const double light =
          713.0 / 32 * std::exp(0.1) *
          integrated(*shape, map.edge_ns(i), map.edge_ns(i + 1), 0.05 - 0.04 * u, std::exp(0.2));
      const double dark = std::exp(-0.3) * 1.75e-4 * 50e6 * 40 / 3780 / 32 * map.cell_ns(i);
      EXPECT_NEAR(photons[i], 0.25 * (light + dark), 2e-5 * 713 / 32) << is_table << ' ' << i;
    }
  }
}

TEST(MapFit, TailIsThePulseLateByAnExponential) {
  const auto shape = make_gaussian(map_sigma_ns);
  const PulseTable pulse(*shape);
  for (const double x : {-0.2, 0.0, 0.1, 0.3, 0.9}) {
    double tail = 0;
    constexpr int steps = 20000;
    for (int k = 0; k < steps; ++k) {  // over quantiles of the exponential
      tail += 0.5 * std::erfc(-(x + 0.2 * std::log((k + 0.5) / steps)) / (0.1 * std::sqrt(2.0)));
    }
    EXPECT_NEAR(pulse.at(x).tail, tail / steps, 2e-4) << x;
    EXPECT_NEAR(pulse.at(x).light, 0.5 * std::erfc(-x / (0.1 * std::sqrt(2.0))), 2e-7) << x;
  }
}

TEST(MapFit, SlopesAreThoseOfTheValue) {
  const FoldedMaker made = interleaved_maker();
  FoldedFrame frame(made.train, 100000);
  made.make(frame, 5);
  const auto shape = make_gaussian(map_sigma_ns);
  ResidualMap map(made.train, *shape, frame.size());
  map.fill(frame, made.track);
  const PulseTable pulse(*shape);
  MapFit fit(map, made.train, pulse);
  fit.begin(frame, made.truth(), 0, {});
  const std::vector<Term> terms = {{Shape::path, 0},  {Shape::path, 2},  {Shape::path, 9},
                                   {Shape::width, 0}, {Shape::width, 2}, {Shape::tail, 0},
                                   {Shape::light, 0}, {Shape::light, 5}, {Shape::dark, 0},
                                   {Shape::early, 0}, {Shape::late, 0}};
  Member member;
  for (const Term& term : terms) member.of(term) = term.shape == Shape::path ? 0.004 : 0.05;
  MapFit::Slopes at;
  fit.slopes(member, terms, at);
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const double step = terms[t].shape == Shape::path ? 1e-5 : 1e-4;
    Member more = member, less = member;
    more.of(terms[t]) += step, less.of(terms[t]) -= step;
    MapFit::Slopes above, below;
    fit.slopes(more, {}, above);
    fit.slopes(less, {}, below);
    const double slope = (above.value - below.value) / (2 * step);
    const auto row = static_cast<Eigen::Index>(t);
    EXPECT_NEAR(at.gradient[row], slope, 1e-2 * std::sqrt(at.information(row, row))) << t;
  }
}

// Photons of a frame made from first principles, in trains of several segments and of two targets,
// are as many as are expected: chi squared of the offsets, within five of its deviations.
void expect_offsets_of(const ModelScene& scene, const likelihood::Model& model) {
  ResidualMap map(scene.train, *scene.shape, scene.folded.size());
  const PulseTable pulse(*scene.shape);
  MapFit fit(map, scene.train, pulse);
  for (std::size_t target = 0; target < model.count; ++target) {
    map.fill(scene.folded, model.targets.at(target).track);
    fit.begin(scene.folded, model, target, {});
    std::array<double, most_cells> counts{}, expected{};
    for (std::size_t j = 0; j < map_parts; ++j) {
      std::array<double, most_cells> photons{};
      fit.expect({}, j, photons);
      for (std::size_t i = 0; i < map.cells(); ++i) {
        counts[i] += map.part(j)[i], expected[i] += photons[i];
      }
    }
    double squares = 0;
    for (std::size_t i = 0; i < map.cells(); ++i) {
      squares += std::pow(counts[i] - expected[i], 2) / expected[i];
    }
    const auto cells = static_cast<double>(map.cells());
    EXPECT_NEAR(squares, cells, 5 * std::sqrt(2 * cells)) << target;
  }
}

likelihood::Model true_model(const ModelScene& scene, const std::vector<test::FrameMaker>& others) {
  likelihood::Model model;
  model.add({scene.track_of(scene.made), scene.made.signal_per_pulse});
  for (const auto& other : others) model.add({scene.track_of(other), other.signal_per_pulse});
  model.background_per_ns = scene.made.background_per_ns;
  return model;
}

TEST(MapFit, ExpectsThePhotonsOfSeveralSegments) {
  test::FrameMaker made = ModelScene::maker(test::mrr_pattern({99900, 104100}, 12e6, 4e8));
  made.length_ms = 4;
  const ModelScene scene(made);
  expect_offsets_of(scene, true_model(scene, {}));
}

TEST(MapFit, ExpectsTheLightOfOtherTargets) {
  test::FrameMaker made = ModelScene::maker(test::interleaved_pattern({180000, 189000}, 3780000));
  made.length_ms = 5;
  // One that is close, and one whose pulses meet others of the first target's.
  const std::vector<test::FrameMaker> others = {made.beside(0.08, 3, 1),
                                                made.beside(9 * 0.299792458 / 2, 0, 3)};
  const ModelScene scene(made, others);
  expect_offsets_of(scene, true_model(scene, others));
}

}  // namespace
}  // namespace splid::checks
