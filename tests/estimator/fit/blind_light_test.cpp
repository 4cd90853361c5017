#include "estimator/fit/blind_light.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include "estimator/fit/likelihood.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr long double c_m_per_ns = 0.299792458L;

test::FrameMaker bright(double dead_time_ns) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  double amplitude = 1;
  for (double& a : made.pattern.segments.front().amplitudes) a = amplitude += 0.02;
  made.length_ms = 0.3;
  made.velocity_mps = 31;
  made.signal_per_pulse = 0.5;
  made.background_per_ns = 0.01;
  made.dead_time_ns = dead_time_ns;
  return made;
}

// Everything that an evaluation with blind time needs, about the line of the truth.
struct BlindScene {
  test::FrameMaker made;
  test::FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  BlindTime blind;
  std::unique_ptr<PulseShape> shape;
  std::vector<CombWindow> windows;
  NearSet near;
  BlindLight light;
  Likelihood likelihood;
  DelayLine truth;
  double bend_ns;  // that the frame was straightened by

  explicit BlindScene(const test::FrameMaker& made_in, std::vector<Loss> losses = {},
                      double bend = 0)
      : made(made_in),
        frame(made.make(11)),
        train(made.pattern),
        folded(train, frame.photons_ps.size(), 3),
        blind(train, made.dead_time_ns, static_cast<std::size_t>(made.inputs),
              frame.photons_ps.size(), 3),
        shape(make_gaussian(made.sigma_ns)),
        windows(comb_windows(train, shape->first_ns() - 1, shape->last_ns() + 1)),
        near(frame.photons_ps.size(), 40 * frame.photons_ps.size()),
        light(*shape, frame.photons_ps.size(), 40 * frame.photons_ps.size()),
        likelihood(*shape, 40 * frame.photons_ps.size()),
        bend_ns(bend) {
    frame.photons_of_input.clear();  // the light is then shared evenly
    frame.losses = std::move(losses);
    std::erase_if(frame.photons_ps, [&](std::int64_t t) {
      for (const Loss& loss : frame.losses) {
        if (t >= loss.begin_ps && t < loss.end_ps) return true;
      }
      return false;
    });
    folded.fold(frame.view(), train);
    blind.find(frame.view(), train);
    if (bend_ns != 0) straighten();
    folded.blind = &blind;
    const double beta = made.velocity_mps / 299792458.0;
    truth = {2 * made.distance_m / 0.299792458 / (1 + beta) / folded.scale,
             2 * beta / (1 + beta) * folded.length_ns};
    near.collect(folded, windows, train, truth);
    light.collect(folded, near, windows, train, 0);
    likelihood.leave_out(&light);
  }
  void straighten() {
    const FoldedFrame bent = folded;
    const BlindTime bent_blind = blind;
    folded.straighten(bent, bend_ns, train);
    blind.straighten(bent_blind, bend_ns, train);
  }
  [[nodiscard]] Exposure exposure() const { return {folded, train}; }
};

// The definition, in long double: each nanosecond-sized step apart from the product's way. Every
// detection blinds the detector for the dead time; the light of every pulse that arrives in that
// time, solved for the meeting point, is not seen. Unions are made as lists of intervals.
struct BruteForce {
  const BlindScene& scene;
  long double tau_ns, beta;

  [[nodiscard]] long double start_ns() const {
    return static_cast<long double>(scene.frame.start_ps - middle()) * 1e-3L;
  }
  [[nodiscard]] std::int64_t middle() const {
    return scene.frame.start_ps + (scene.frame.end_ps - scene.frame.start_ps) / 2;
  }
  [[nodiscard]] long double ns(std::int64_t ps) const {
    return static_cast<long double>(ps - middle()) * 1e-3L;
  }

  // Calls visit(amplitude, arrival) for each pulse that arrives from `from` less 60 widths to `to`.
  template <class Visit>
  void pulses(long double from, long double to, const Visit& visit) const {
    const long double period = static_cast<long double>(scene.frame.sync.period_ps) * 1e-3L;
    const long double scale = period / scene.train.period_ns;
    const auto bend = [&](long double t) {
      const long double s = t / (ns(scene.frame.end_ps) - ns(scene.frame.start_ps));
      return scene.bend_ns * (s * s - 1 / 12.0L);
    };
    const auto emitted = [&](long double t) {
      return (t - tau_ns / (1 - beta)) * (1 - beta) / (1 + beta) - bend(t);
    };
    const auto arrival = [&](long double e) {
      long double at = tau_ns / (1 - beta) + e * (1 + beta) / (1 - beta);
      // Each round leaves 1e-5 of the error.
      for (int round = 0; round < 4; ++round) {
        at = tau_ns / (1 - beta) + (e + bend(at)) * (1 + beta) / (1 - beta);
      }
      return at;
    };
    const long double margin = 60 * scene.made.sigma_ns;
    const auto first =
        static_cast<std::int64_t>(std::floor((emitted(from - margin) - start_ns()) / period)) - 1;
    const auto last =
        static_cast<std::int64_t>(std::floor((emitted(to + margin) - start_ns()) / period)) + 1;
    for (std::int64_t turn = first; turn <= last; ++turn) {
      long double begin = 0;
      for (const PatternSegment& segment : scene.made.pattern.segments) {
        const std::int64_t repeats = scene.made.pattern.segments.size() == 1 ? 1 : segment.repeats;
        for (std::int64_t r = 0; r < repeats; ++r, begin += segment.period_ps * 1e-3L) {
          for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
            const long double e =
                start_ns() + turn * period + (begin + segment.pulse_times_ps[p] * 1e-3L) * scale;
            const long double at = arrival(e);
            if (at > from - margin && at < to + margin) visit(segment.amplitudes[p], at);
          }
        }
      }
    }
  }

  [[nodiscard]] long double light(long double from, long double to) const {
    const long double unit = scene.made.sigma_ns * std::sqrt(2.0L);
    long double sum = 0;
    pulses(from, to, [&](long double a, long double at) {
      // Far from the pulse the difference of two complements keeps its digits.
      sum += a * (std::erfc((from - at) / unit) - std::erfc((to - at) / unit)) / 2;
    });
    return sum;
  }

  struct Interval {
    std::int64_t from, to;
  };
  [[nodiscard]] std::vector<Interval> blind() const {
    std::vector<std::int64_t> all = scene.frame.before_ps;
    all.insert(all.end(), scene.frame.photons_ps.begin(), scene.frame.photons_ps.end());
    std::vector<Interval> intervals;
    const std::int64_t dead_ps = std::llround(scene.made.dead_time_ns * 1e3);
    for (std::size_t i = 0; i < all.size(); ++i) {
      std::int64_t to = std::min(all[i] + dead_ps, scene.frame.end_ps);
      if (scene.made.inputs == 1 && i + 1 < all.size()) to = std::min(to, all[i + 1]);
      std::vector<Interval> parts = {{std::max(all[i], scene.frame.start_ps), to}};
      for (const Loss& loss : scene.frame.losses) {
        std::vector<Interval> left;
        for (const Interval& part : parts) {
          left.push_back({part.from, std::min(part.to, loss.begin_ps)});
          left.push_back({std::max(part.from, loss.end_ps), part.to});
        }
        parts = left;
      }
      for (const Interval& part : parts) {
        if (part.to > part.from) intervals.push_back(part);
      }
    }
    return intervals;
  }

  [[nodiscard]] long double value(long double S, long double b) const {
    long double value = 0;
    for (const std::int64_t photon : scene.frame.photons_ps) {
      const long double t = ns(photon);
      long double density = 0;
      pulses(t, t, [&](long double a, long double at) {
        const long double x = (t - at) / scene.made.sigma_ns;
        density += a * std::exp(-x * x / 2) /
                   (scene.made.sigma_ns * std::sqrt(2 * std::numbers::pi_v<long double>));
      });
      value += std::log(b + S * density);
    }
    long double seen = ns(scene.frame.end_ps) - ns(scene.frame.start_ps);
    for (const Loss& loss : scene.frame.losses) seen -= ns(loss.end_ps) - ns(loss.begin_ps);
    long double amplitude =
        scene.train.amplitude_per_ns / scene.folded.scale * seen * (1 - beta) / (1 + beta);
    for (const Interval& interval : blind()) {
      seen -= (ns(interval.to) - ns(interval.from)) / scene.made.inputs;
      amplitude -= light(ns(interval.from), ns(interval.to)) / scene.made.inputs;
    }
    return value - b * seen - S * amplitude;
  }
};

void expect_brute_force(BlindScene& scene, double S, double b, double delay_off_ns,
                        double velocity_mps, double tolerance = 1e-6) {
  const double beta = velocity_mps / 299792458.0;
  const double tau = 2 * scene.made.distance_m / 0.299792458 + delay_off_ns;
  const DelayLine line = {tau / (1 + beta) / scene.folded.scale,
                          2 * beta / (1 + beta) * scene.folded.length_ns};
  const double value = scene.likelihood.evaluate(scene.near, scene.exposure(), {line, S, b}).value;
  const BruteForce brute{scene, tau, beta};
  const auto expected = static_cast<double>(brute.value(S, b));
  EXPECT_NEAR(value, expected, 1e-9 * std::abs(expected) + tolerance) << S << " " << b;
}

TEST(BlindLight, MakesTheLikelihoodTheExactOneOfABlindDetector) {
  // Shorter than the pulses are apart, as long as some of them, and as two pattern periods.
  for (const double dead_ns : {0.15, 7.0, 50.0, 300.0, 7700.0}) {
    BlindScene scene(bright(dead_ns));
    EXPECT_TRUE(dead_ns < 20 || !scene.frame.before_ps.empty());
    expect_brute_force(scene, 0.5, 0.01, 0, 31);
    expect_brute_force(scene, 2, 0.1, 0.07, 30);
    expect_brute_force(scene, 1e-6, 1e-6, -0.3, 33);
  }
}

TEST(BlindLight, HoldsInDriftingClocksAndForWidePulses) {
  test::FrameMaker drifting = bright(50);
  drifting.drift_ppm = 100;
  drifting.start_ps = 340000000000000000;
  BlindScene late(drifting);
  expect_brute_force(late, 0.5, 0.01, 0.03, 31);
  test::FrameMaker wide = bright(11);
  wide.sigma_ns = 5;  // pulses are 9 ns apart
  BlindScene broad(wide);
  expect_brute_force(broad, 0.5, 0.01, 0.3, 31);
}

// In a train of several combs one dead time may begin in one comb and end in the next: these are
// taken at the rate of the first, which is off by a hundredth of a pulse here.
TEST(BlindLight, HoldsForRatesInTurn) {
  test::FrameMaker made = bright(50);
  made.pattern = test::mrr_pattern({180000, 189000}, 3780000, 3e7);
  BlindScene scene(made);
  const BruteForce brute{scene, 2 * made.distance_m / c_m_per_ns, 31 / 299792458.0L};
  const auto value =
      scene.likelihood.evaluate(scene.near, scene.exposure(), {scene.truth, 0.5, 0.01}).value;
  EXPECT_NEAR(value, static_cast<double>(brute.value(0.5, 0.01)), 0.2);
}

TEST(BlindLight, StopsAtLossesAndGoesOnBehindThem) {
  const BlindScene whole(bright(50));
  std::vector<Loss> losses;
  // From shortly before a photon on, from shortly after one on for less than the dead time, for a
  // long time, and at the frame's end.
  for (const auto& [photon, from, length] :
       {std::tuple{100, -5'000, 20'000}, {200, 10'000, 15'000}, {300, 30'000, 700'000}}) {
    const std::int64_t at = whole.frame.photons_ps[static_cast<std::size_t>(photon)] + from;
    losses.push_back({at, at + length, 0});
  }
  losses.push_back({whole.frame.end_ps - 1'000, whole.frame.end_ps, 0});
  BlindScene scene(bright(50), losses);
  expect_brute_force(scene, 0.5, 0.01, 0.02, 31);
}

// The path bends by 20 pulse widths. What is left out is 1e-6 of the light that is hidden.
TEST(BlindLight, IsStraightenedWithThePhotonsOfAPathThatBends) {
  test::FrameMaker made = bright(50);
  made.acceleration_mps2 = 6.66e6;
  const double bend_ns = made.acceleration_mps2 * 9e-8 / 0.299792458;
  const BlindScene whole(made);
  const std::int64_t at = whole.frame.photons_ps[200] + 10'000;
  BlindScene scene(made, {{at, at + 15'000, 0}}, bend_ns);
  ASSERT_GT(scene.blind.begins.size(), 1U);
  expect_brute_force(scene, 0.5, 0.01, bend_ns / 12, 31, 0.01);
  expect_brute_force(scene, 2, 0.1, bend_ns / 12 + 0.07, 30, 0.01);
}

TEST(BlindLight, SharesTheBlindTimeAmongSplitDetectors) {
  test::FrameMaker made = bright(50);
  made.inputs = 3;
  BlindScene scene(made);
  expect_brute_force(scene, 0.5, 0.01, 0.02, 31);
}

TEST(BlindLight, GradientAndHessianAgreeWithDifferences) {
  for (const double sigma_ns : {0.1, 5.0}) {
    test::FrameMaker made = bright(40);
    made.sigma_ns = sigma_ns;
    BlindScene scene(made);
    const FrameParameters at = {
        {scene.truth.delay_ns + 0.3 * sigma_ns, scene.truth.travel_ns - 0.7 * sigma_ns}, 0.3, 3e-3};
    const auto shifted = [&](int index, double by) {
      FrameParameters p = at;
      (index == 0   ? p.line.delay_ns
       : index == 1 ? p.line.travel_ns
       : index == 2 ? p.signal_per_pulse
                    : p.background_per_ns) += by;
      return scene.likelihood.evaluate(scene.near, scene.exposure(), p);
    };
    const LikelihoodPoint point = shifted(0, 0);
    const double steps[] = {1e-4 * sigma_ns, 1e-4 * sigma_ns, 1e-6, 1e-7};
    for (int i = 0; i < 4; ++i) {
      const LikelihoodPoint up = shifted(i, steps[i]);
      const LikelihoodPoint down = shifted(i, -steps[i]);
      const double slope = (up.value - down.value) / (2 * steps[i]);
      EXPECT_NEAR(point.gradient[i], slope, 1e-5 * std::abs(slope) + 1e-3) << i;
      for (int j = 0; j < 4; ++j) {
        const double second = (up.gradient[j] - down.gradient[j]) / (2 * steps[i]);
        const double scale = std::sqrt(std::abs(point.hessian(i, i) * point.hessian(j, j)));
        EXPECT_NEAR(point.hessian(i, j), second, 1e-5 * scale) << i << j;
      }
    }
  }
}

TEST(BlindLight, ProfileIsTheMaximumOverSignalAndBackground) {
  BlindScene scene(bright(50));
  const auto profile = scene.likelihood.profile(scene.near, scene.exposure(), scene.truth);
  const LikelihoodPoint point =
      scene.likelihood.evaluate(scene.near, scene.exposure(), profile.parameters);
  EXPECT_NEAR(point.value, profile.value, 1e-9 * std::abs(profile.value));
  EXPECT_NEAR(point.gradient[signal_index] * profile.parameters.signal_per_pulse, 0, 1e-6);
  EXPECT_NEAR(point.gradient[background_index] * profile.parameters.background_per_ns, 0, 1e-6);
  EXPECT_NEAR(profile.parameters.signal_per_pulse, 0.5, 0.05);
  EXPECT_NEAR(profile.parameters.background_per_ns, 0.01, 0.002);
}

}  // namespace
}  // namespace splid
