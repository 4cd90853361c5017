#include "estimator/model/pulse_shape.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace splid {
namespace {

struct Point {
  double h, d1, d2;
};

Point at(const PulseShape& shape, double offset_ns) {
  Point p{};
  shape.evaluate({&offset_ns, 1}, {{&p.h, 1}, {&p.d1, 1}, {&p.d2, 1}});
  return p;
}

// A sharp edge and an exponential tail of 150 ps, as a real detector has it.
TabulatedPulse tailed_pulse() {
  TabulatedPulse table{-100, 10, {}};
  for (int i = 0; i < 120; ++i) {
    const double t = table.first_ps + 10.0 * i;
    table.density.push_back(t < 0 ? std::exp(-0.5 * t * t / 900) : std::exp(-t / 150));
  }
  return table;
}

void expect_unit_integral_and_true_derivatives(const PulseShape& shape) {
  const double step = shape.width_ns() / 50;
  double integral = 0;
  for (double x = shape.first_ns() - step; x < shape.last_ns() + step; x += step) {
    const Point p = at(shape, x);
    integral += p.h * step;
    // Off the knots of a table, where its second derivative jumps.
    const double e = step * 1e-3;
    const double scale = at(shape, shape.peak_offset_ns()).h / shape.width_ns();
    EXPECT_NEAR(p.d1, (at(shape, x + e).h - at(shape, x - e).h) / (2 * e), 1e-3 * scale) << x;
    EXPECT_GE(p.h, 0);
  }
  EXPECT_NEAR(integral, 1, 2e-4);
}

void expect_the_integral_of_its_density(const PulseShape& shape) {
  const double step = shape.width_ns() / 500;
  double sum = 0;
  for (double x = shape.first_ns() - step; x < shape.last_ns() + step; x += step) {
    const double middle = x + step / 2;
    double integral = -1;
    shape.integrate({&middle, 1}, {&integral, 1});
    EXPECT_NEAR(integral, sum + at(shape, x + step / 4).h * step / 2, 2e-6) << x;
    sum += at(shape, middle).h * step;
  }
  const double ends[] = {-1e9, shape.first_ns(), shape.last_ns(), 1e9};
  double integrals[4] = {};
  shape.integrate(ends, integrals);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(integrals[k], k / 2, 1e-12);
}

TEST(PulseShape, IntegratesItsDensity) {
  expect_the_integral_of_its_density(*make_gaussian(0.1));
  expect_the_integral_of_its_density(*make_tabulated(tailed_pulse()));
}

TEST(PulseShape, GaussianIsADensityWithItsDerivatives) {
  const auto shape = make_gaussian(0.1);
  expect_unit_integral_and_true_derivatives(*shape);
  EXPECT_DOUBLE_EQ(at(*shape, 0).h, 1 / (0.1 * std::sqrt(2 * std::numbers::pi)));
  const double e = 1e-5;
  for (const double x : {-0.31, -0.05, 0.0, 0.12, 0.4}) {
    EXPECT_NEAR(at(*shape, x).d2, (at(*shape, x + e).d1 - at(*shape, x - e).d1) / (2 * e), 1e-4);
  }
}

TEST(PulseShape, LogOfAGaussianHoldsWhereTheGaussianUnderflows) {
  const auto shape = make_gaussian(0.001);
  EXPECT_EQ(at(*shape, 4.5).h, 0);
  EXPECT_NEAR(shape->log_h(4.5), -0.5 * 4500.0 * 4500.0 - std::log(0.001 * std::sqrt(2 * M_PI)),
              1e-6);
  EXPECT_NEAR(shape->log_h(0.002), std::log(at(*shape, 0.002).h), 1e-12);
}

TEST(PulseShape, TableIsADensityWithItsDerivatives) {
  const auto shape = make_tabulated(tailed_pulse());
  expect_unit_integral_and_true_derivatives(*shape);
  EXPECT_NEAR(shape->peak_offset_ns(), 0, 0.011);
  EXPECT_EQ(at(*shape, shape->last_ns() + 1e-6).h, 0);
  EXPECT_EQ(at(*shape, shape->first_ns() - 1e-6).h, 0);
  EXPECT_EQ(shape->log_h(5), -INFINITY);
}

TEST(PulseShape, TableOfAGaussianIsNearlyThatGaussian) {
  TabulatedPulse table{-600, 10, {}};
  for (int i = 0; i <= 120; ++i) {
    const double t = (table.first_ps + 10.0 * i) / 100;
    table.density.push_back(7 * std::exp(-0.5 * t * t));
  }
  const auto tabulated = make_tabulated(table);
  const auto gaussian = make_gaussian(0.1);
  EXPECT_NEAR(tabulated->width_ns(), 0.1, 1e-3);
  for (double x = -0.4; x <= 0.4; x += 0.013) {
    EXPECT_NEAR(at(*tabulated, x).h, at(*gaussian, x).h, 0.01);
    EXPECT_NEAR(at(*tabulated, x).d1, at(*gaussian, x).d1, 0.5);
  }
}

}  // namespace
}  // namespace splid
