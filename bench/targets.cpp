// How several targets in a frame are told apart, what that costs, and how often a pulse of another
// shape than the configured one is taken for several: the tables of
// docs/evidence/data/targets*.csv.
//
//   targets [TRIALS [NAME]]     by default 1000 frames for each row; rows whose scene has NAME, and
//                               the table of two that are looked for as one by the name "as one",
//                               that of targets at any places by the name "anywhere"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bench/thread_clock.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/likelihood/bound.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double m_per_ns_of_delay = 0.299792458 / 2;
constexpr double length_ms = 50;
constexpr double sigma_ns = 0.1;
constexpr double experiment_signal = 13.5e-4;

// A target beside the first one.
struct Beside {
  double delay_widths = 0;  // further away by so many pulse widths, at mid-frame
  double velocity_mps = 0;  // faster by this
  double signal = experiment_signal;
};

struct Scene {
  const char* name;
  std::vector<Beside> others;
  double first_signal = experiment_signal;
  std::int64_t targets = 2;  // scene.targets
  double side = 0;           // 1: the others are behind the first, -1: before it, 0: either
};

struct Score {
  int listed = 0, all_right = 0, extra = 0;
  std::vector<double> squares_delay, squares_velocity;  // over the bound, of each target
  std::vector<int> inside;
};

struct Truth {
  double delay_ns, velocity_mps, signal;
};

test::FrameMaker::Frame make(const std::vector<Truth>& truths, const Pattern& pattern,
                             std::uint64_t seed) {
  test::FrameMaker maker;
  maker.pattern = pattern;
  maker.length_ms = length_ms;
  test::FrameMaker::Frame frame;
  for (std::size_t k = 0; k < truths.size(); ++k) {
    maker.distance_m = truths[k].delay_ns * m_per_ns_of_delay;
    maker.velocity_mps = truths[k].velocity_mps;
    maker.signal_per_pulse = truths[k].signal;
    if (k > 0) maker.background_per_ns = 0;
    const auto one = maker.make(seed * 8 + k);
    if (k == 0) {
      frame = one;
    } else {
      frame.photons_ps.insert(frame.photons_ps.end(), one.photons_ps.begin(), one.photons_ps.end());
    }
  }
  std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
  return frame;
}

std::vector<TargetEstimate> listed(const Estimate& e) {
  if (!e.has_values || e.status == FrameStatus::no_target) return {};
  if (e.target_count == 0) return {e.first_target()};
  return {e.targets.begin(), e.targets.begin() + static_cast<std::ptrdiff_t>(e.target_count)};
}

// Returns whether all are resolved. A target is right where its delay and velocity are off by no
// more than twelve deviations of the bound of several targets, both together. It is elsewhere where
// no true target is within five widths.
bool judge(const Estimate& e, const std::vector<Truth>& truths, const std::vector<Bound>& bounds,
           Score& score) {
  const std::vector<TargetEstimate> found = listed(e);
  score.listed += static_cast<int>(found.size());
  std::vector<const TargetEstimate*> of(truths.size(), nullptr);
  std::vector<bool> used(found.size(), false);
  for (std::size_t k = 0; k < truths.size(); ++k) {
    double nearest = 1e300;
    std::size_t best = 0;
    for (std::size_t n = 0; n < found.size(); ++n) {
      if (used[n]) continue;
      const double off =
          std::abs(std::remainder(found[n].delay_ns - truths[k].delay_ns, 3780.0)) /
              bounds[k].delay_ns +
          std::abs(found[n].velocity_mps - truths[k].velocity_mps) / bounds[k].velocity_mps;
      if (off < nearest) {
        nearest = off;
        best = n;
      }
    }
    if (nearest > 12) continue;
    of[k] = &found[best];
    used[best] = true;
  }
  for (const TargetEstimate& target : found) {
    const bool is_near = std::any_of(truths.begin(), truths.end(), [&](const Truth& truth) {
      return std::abs(std::remainder(target.delay_ns - truth.delay_ns, 3780.0)) < 5 * sigma_ns;
    });
    if (!is_near) ++score.extra;
  }
  if (std::count(of.begin(), of.end(), nullptr) > 0) return false;
  ++score.all_right;
  for (std::size_t k = 0; k < truths.size(); ++k) {
    const double off = std::remainder(of[k]->delay_ns - truths[k].delay_ns, 3780.0);
    score.squares_delay[k] += std::pow(off / bounds[k].delay_ns, 2);
    score.squares_velocity[k] +=
        std::pow((of[k]->velocity_mps - truths[k].velocity_mps) / bounds[k].velocity_mps, 2);
    score.inside[k] += std::abs(off) <= of[k]->std_delay_ns ? 1 : 0;
  }
  return true;
}

double median(std::vector<double> of) {
  const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
  std::nth_element(of.begin(), middle, of.end());
  return *middle;
}

// An estimator, and how long it took for its last frame.
struct Timed {
  FrameEstimator estimator;
  double took_ms = 0;

  Timed(const Pattern& pattern, std::int64_t targets)
      : estimator(pattern, {}, scene_of(targets), {}, length_ms, 200000) {}

  static SceneOptions scene_of(std::int64_t targets) {
    SceneOptions options;
    options.targets = targets;
    return options;
  }
  Estimate estimate(const test::FrameMaker::Frame& frame) {
    const double begin_ms = bench::thread_ms();
    Estimate e = estimator.estimate(frame.view());
    took_ms = bench::thread_ms() - begin_ms;
    return e;
  }
};

// How long the frames of a scene took: all of them, those in which all targets are resolved, the
// others, and those of the first target alone.
struct Times {
  std::vector<double> all_ms, resolved_ms, others_ms, alone_ms;

  void add(double took_ms, bool is_resolved) {
    all_ms.push_back(took_ms);
    (is_resolved ? resolved_ms : others_ms).push_back(took_ms);
  }
  void print() const {
    const double one_ms = median(alone_ms);
    std::printf(" | %.2f | %.2f", median(all_ms), median(all_ms) / one_ms);
    const bool are_both = !resolved_ms.empty() && !others_ms.empty();
    for (const auto* of : {&resolved_ms, &others_ms}) {
      if (are_both) {
        std::printf(" | %.2f", median(*of) / one_ms);
      } else {
        std::printf(" | ");
      }
    }
    std::printf(" |\n");
    std::fflush(stdout);
  }
};

// The cost of a scene is compared with that of its first target alone and scene.targets 1, frame by
// frame in turn, so that both meet the same machine.
void run(const Scene& scene, int trials) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  Timed all(pattern, scene.targets), one(pattern, 1);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> velocity(-100, 100), distance(284, 285), sign(-1, 1);
  Score score;
  Times times;
  const std::size_t count = scene.others.size() + (scene.first_signal > 0 ? 1 : 0);
  score.squares_delay.resize(count);
  score.squares_velocity.resize(count);
  score.inside.resize(count);
  std::vector<Bound> bounds;
  for (int n = 0; n < trials; ++n) {
    std::vector<Truth> truths = {
        {distance(random) / m_per_ns_of_delay, velocity(random), scene.first_signal}};
    const double either = sign(random) < 0 ? -1 : 1;
    const double side = scene.side != 0 ? scene.side : either;
    for (const Beside& other : scene.others) {
      truths.push_back({truths[0].delay_ns + side * other.delay_widths * sigma_ns,
                        truths[0].velocity_mps + side * other.velocity_mps, other.signal});
    }
    const auto frame = make(truths, pattern, static_cast<std::uint64_t>(n));
    const auto frame_of_first = make({truths[0]}, pattern, static_cast<std::uint64_t>(n));
    if (scene.first_signal == 0) truths.clear();
    if (bounds.empty() && !truths.empty()) {
      std::vector<BoundScene> scenes;
      for (const Truth& truth : truths) {
        scenes.push_back({length_ms * 1e6, length_ms * 1e6, truth.delay_ns, truth.velocity_mps,
                          truth.signal, 1.75e-4});
      }
      bounds = joint_bound(pattern, *make_gaussian(sigma_ns), scenes);
    }
    one.estimate(frame_of_first);
    times.alone_ms.push_back(one.took_ms);
    const bool is_resolved = judge(all.estimate(frame), truths, bounds, score);
    times.add(all.took_ms, is_resolved);
  }
  std::printf("| %s | %d | %.1f %% | %.2f %% |", scene.name, static_cast<int>(scene.targets),
              100.0 * score.all_right / trials, 100.0 * score.extra / trials);
  if (!bounds.empty()) {
    std::printf(" %.2f, %.1f", bounds[0].delay_ns * m_per_ns_of_delay * 1e3,
                bounds[0].velocity_mps * 1e2);
  }
  std::printf(" |");
  std::string delay, velocities, within;
  char text[40];
  for (std::size_t k = 0; k < count && score.all_right > 0; ++k) {
    const char* comma = k > 0 ? ", " : "";
    std::snprintf(text, sizeof text, "%s%.2f", comma,
                  std::sqrt(score.squares_delay[k] / score.all_right));
    delay += text;
    std::snprintf(text, sizeof text, "%s%.2f", comma,
                  std::sqrt(score.squares_velocity[k] / score.all_right));
    velocities += text;
    std::snprintf(text, sizeof text, "%s%.0f %%", comma, 100.0 * score.inside[k] / score.all_right);
    within += text;
  }
  std::printf(" %s | %s | %s", delay.c_str(), velocities.c_str(), within.c_str());
  times.print();
}

// A second target that is not asked for: how often the only one that is listed is off either target
// by more than 4.5 deviations, of those that one target alone has and of those published, and how
// often a finding or the status says that something is wrong.
void run_as_one(const Beside& beside, int trials) {
  constexpr double far_off = 4.5;
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  Timed one(pattern, 1);
  int pulled = 0, sure = 0, said = 0;
  for (int n = 0; n < trials; ++n) {
    const Truth first = {(284 + n * 1e-3) / m_per_ns_of_delay, 20, experiment_signal};
    const Truth second = {first.delay_ns + beside.delay_widths * sigma_ns,
                          first.velocity_mps + beside.velocity_mps, beside.signal};
    const auto seed = static_cast<std::uint64_t>(n);
    const Estimate alone = one.estimate(make({first}, pattern, seed));
    const Estimate e = one.estimate(make({first, second}, pattern, seed));
    const auto off = [&](const Truth& truth, const Estimate& deviations) {
      return std::max(std::abs(e.delay_ns - truth.delay_ns) / deviations.std_delay_ns,
                      std::abs(e.velocity_mps - truth.velocity_mps) / deviations.std_velocity_mps);
    };
    pulled += std::min(off(first, alone), off(second, alone)) > far_off ? 1 : 0;
    sure += std::min(off(first, e), off(second, e)) > far_off ? 1 : 0;
    said += e.status != FrameStatus::ok || !e.findings.all().empty() ? 1 : 0;
  }
  std::printf("| %g | %g | %g | %.1f %% | %.1f %% | %.1f %% |\n", beside.delay_widths,
              beside.velocity_mps, beside.signal / experiment_signal, 100.0 * pulled / trials,
              100.0 * sure / trials, 100.0 * said / trials);
  std::fflush(stdout);
}

// A pulse that is not the configured one: its light has another width, or a share of it comes late
// by an exponential delay.
struct OtherPulse {
  const char* name;
  double sigma_ns = splid::sigma_ns;
  double tail_ns = 0;
  double late_share = 1.0 / 8;
  double light = 4 * experiment_signal;
  std::int64_t targets = 3;
};

test::FrameMaker::Frame make_shaped(const OtherPulse& pulse, const Pattern& pattern,
                                    std::uint64_t seed) {
  test::FrameMaker maker;
  maker.pattern = pattern;
  maker.length_ms = length_ms;
  maker.velocity_mps = 20;
  maker.sigma_ns = pulse.sigma_ns;
  const double light = pulse.light;
  maker.signal_per_pulse = pulse.tail_ns > 0 ? light * (1 - pulse.late_share) : light;
  auto frame = maker.make(2 * seed);
  if (pulse.tail_ns == 0) return frame;
  maker.signal_per_pulse = light * pulse.late_share;
  maker.background_per_ns = 0;
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> late_ns(1 / pulse.tail_ns);
  for (const std::int64_t photon_ps : maker.make(2 * seed + 1).photons_ps) {
    const std::int64_t late_ps = photon_ps + std::llround(1e3 * late_ns(random));
    if (late_ps < frame.end_ps) frame.photons_ps.push_back(late_ps);
  }
  std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
  return frame;
}

void run_shape(const OtherPulse& pulse, int trials) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  SceneOptions options;
  options.targets = pulse.targets;
  FrameEstimator estimator(pattern, {}, options, {}, length_ms, 200000);
  int found = 0, claimed = 0;
  for (int n = 0; n < trials; ++n) {
    const auto frame = make_shaped(pulse, pattern, static_cast<std::uint64_t>(n));
    const Estimate e = estimator.estimate(frame.view());
    found += e.status == FrameStatus::ok ? 1 : 0;
    claimed += e.target_count > 1 ? 1 : 0;
  }
  std::printf("| %s | %.1f %% | %.2f %% |\n", pulse.name, 100.0 * found / trials,
              100.0 * claimed / trials);
  std::fflush(stdout);
}

// Targets at any places.
struct Anywhere {
  const char* name;
  Pattern pattern;
  double signal = experiment_signal;  // of the first; of the others 0.3 to 1 of it
};

std::vector<Anywhere> all_patterns() {
  const double of_one_in_forty = 40 * experiment_signal;
  return {{"interleaved", test::interleaved_pattern({180000, 189000}, 3780000)},
          {"mrr", test::mrr_pattern({180000, 189000}, 3780000, 37800000)},
          {"random", test::random_pattern(3780000, 40, 9000, 3)},
          {"one pulse in 3780 ns", test::periodic_pattern(3780000), of_one_in_forty}};
}

// By how much the others are faster or slower than the first at most; nothing: each has any
// velocity within 100 m/s.
struct Motion {
  const char* name;
  std::optional<double> most_apart_mps = {};
};

// What any number of targets costs where they are at any places. A target is right where it is
// within a width and 0.5 m/s of a true one that is no other's.
void run_anywhere(const Anywhere& scene, std::size_t count, const Motion& motion, int trials) {
  Timed all(scene.pattern, static_cast<std::int64_t>(count)), one(scene.pattern, 1);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> velocity(-100, 100), delay(100, 3600), share(0.3, 1);
  std::vector<double> all_ms, alone_ms;
  int right = 0, elsewhere = 0;
  for (int n = 0; n < trials; ++n) {
    std::vector<Truth> truths = {{delay(random), velocity(random), scene.signal}};
    while (truths.size() < count) {
      double mps = velocity(random);
      if (motion.most_apart_mps) {
        const double beside_mps = truths[0].velocity_mps + mps / 100 * *motion.most_apart_mps;
        mps = std::clamp(beside_mps, -100.0, 100.0);
      }
      truths.push_back({delay(random), mps, scene.signal * share(random)});
    }
    const auto seed = static_cast<std::uint64_t>(n);
    one.estimate(make({truths[0]}, scene.pattern, seed));
    const std::vector<TargetEstimate> found =
        listed(all.estimate(make(truths, scene.pattern, seed)));
    all_ms.push_back(all.took_ms);
    alone_ms.push_back(one.took_ms);
    std::size_t matched = 0;
    for (const TargetEstimate& target : found) {
      const auto own = std::find_if(truths.begin(), truths.end(), [&](const Truth& truth) {
        return std::abs(std::remainder(target.delay_ns - truth.delay_ns, 3780.0)) < sigma_ns &&
               std::abs(target.velocity_mps - truth.velocity_mps) < 0.5;
      });
      if (own == truths.end()) continue;
      truths.erase(own);
      ++matched;
    }
    right += truths.empty() ? 1 : 0;
    elsewhere += matched < found.size() ? 1 : 0;
  }
  std::sort(all_ms.begin(), all_ms.end());
  const double one_ms = median(alone_ms);
  std::printf("| %s | %zu | %s | %.1f %% | %.1f %% | %.2f | %.2f |\n", scene.name, count,
              motion.name, 100.0 * right / trials, 100.0 * elsewhere / trials,
              all_ms[all_ms.size() / 2] / one_ms, all_ms[all_ms.size() * 9 / 10] / one_ms);
  std::fflush(stdout);
}

void run_all_anywhere(int trials) {
  std::printf(
      "\n| pattern | targets | velocity | all right | any elsewhere | p50 of the first alone | p90 "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const Anywhere& scene : all_patterns()) {
    for (std::size_t count = 2; count <= most_targets; ++count) {
      for (const Motion& motion :
           {Motion{"one", 0}, Motion{"within 15 m/s", 15}, Motion{"their own"}}) {
        run_anywhere(scene, count, motion, trials);
      }
    }
  }
}

// The rows of the first table.
std::vector<Scene> all_scenes() {
  constexpr double s = experiment_signal;
  return {
      {"no target", {}, 0, 1},
      {"no target", {}, 0, 2},
      {"one", {}, s, 1},
      {"one", {}, s, 2},
      {"two, 3 widths apart", {{3, 0, s}}},
      {"two, 4 widths apart", {{4, 0, s}}},
      {"two, 5 widths apart", {{5, 0, s}}},
      {"two, 1 m apart", {{66.7, 0, s}}},
      {"1:3, 5 widths apart", {{5, 0, s / 3}}, s},
      {"two, 30 m apart", {{2001.4, 0, s}}},
      {"two, 0.7 m/s apart", {{0, 0.7, s}}},
      {"two, 1 m/s apart", {{0, 1, s}}},
      {"two, 1.2 m/s apart", {{0, 1.2, s}}},
      {"two, 1.4 m/s apart", {{0, 1.4, s}}},
      {"two, 2 m/s apart", {{0, 2, s}}},
      {"two, 3.1 m/s apart", {{0, 3.12, s}}},
      {"two, 30 m and 20 m/s apart", {{2001.4, 20, s}}},
      {"two, 63 ns apart", {{630, 0, s}}},
      {"two, 180 ns apart", {{1800, 0, s}}},
      {"1:20, 1 m apart", {{66.7, 0, s / 5}}, s * 4},
      {"1:20, 30 m and 20 m/s apart", {{2001.4, 20, s / 5}}, s * 4},
      {"the weaker alone", {}, s / 5, 1},
      {"the weaker alone", {}, s / 5, 2},
      {"the brighter alone", {}, s * 4, 1},
      {"the brighter alone", {}, s * 4, 2},
      {"1:20, 8.5 widths apart", {{8.5, 0, s / 5}}, s * 4},
      {"1:20, 6 widths apart", {{6, 0, s / 5}}, s * 4},
      {"1:20, 5 widths apart", {{5, 0, s / 5}}, s * 4},
      {"1:20, 4 widths apart", {{4, 0, s / 5}}, s * 4},
      {"1:20, 3 widths before", {{3, 0, s / 5}}, s * 4, 2, -1},
      {"1:20, 3 widths behind", {{3, 0, s / 5}}, s * 4, 2, 1},
      {"1:20, 3 widths behind and 2 m/s faster", {{3, 2, s / 5}}, s * 4, 2, 1},
      {"1:20, 5 widths behind and 2 m/s faster", {{5, 2, s / 5}}, s * 4, 2, 1},
      {"1:20, 3.1 m/s apart", {{0, 3.12, s / 5}}, s * 4},
      {"three, 3 widths apart", {{3, 0, s}, {6, 0, s}}, s, 3},
      {"three, 4 widths apart", {{4, 0, s}, {8, 0, s}}, s, 3},
      {"three, 5 widths apart", {{5, 0, s}, {10, 0, s}}, s, 3},
      {"three, 4 widths apart, three times the signal", {{4, 0, 3 * s}, {8, 0, 3 * s}}, 3 * s, 3},
      {"1:3, 5 widths apart, and a third 25 widths behind", {{5, 0, s / 3}, {30, 0, s}}, s, 3},
      {"three, 1 m apart", {{66.7, 0, s}, {133.4, 0, s}}, s, 3},
      {"four, 1 m apart", {{66.7, 0, s}, {133.4, 0, s}, {200.1, 0, s}}, s, 4},
      {"three, 7 and 25 m and 10 and 30 m/s apart", {{467, 10, s / 2}, {1667, -30, s / 3}}, s, 3},
      {"four, 7 to 60 m and 10 to 55 m/s apart",
       {{467, 10, s / 2}, {1667, -30, s / 3}, {4000, 55, s / 2}},
       s,
       4},
  };
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 1000;
  const std::string name = argc > 2 ? argv[2] : "";
  constexpr double s = splid::experiment_signal;
  std::printf(
      "| scene | targets | all resolved | claimed elsewhere | bound, mm and cm/s | distance / "
      "bound "
      "| velocity / bound | within | p50, ms | of the first alone | where resolved | where not |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const splid::Scene& scene : splid::all_scenes()) {
    if (std::string(scene.name).find(name) != std::string::npos) splid::run(scene, trials);
  }
  if (std::string("anywhere").find(name) != std::string::npos) splid::run_all_anywhere(trials);
  if (std::string("as one").find(name) != std::string::npos) {
    std::printf(
        "\n| widths apart | m/s apart | of the signal | pulled | off by the deviations | said so "
        "|\n"
        "|---|---|---|---|---|---|\n");
    const std::vector<splid::Beside> not_asked_for = {
        {1, 0, s / 2}, {1, 1, s}, {2, 0, s}, {2, 1, s}, {4, 0.5, s}, {5, 2, s / 2},
        {7, 4, s / 2}, {7, 4, s}, {8, 4, s}, {7, 0, s}, {10, 4, s},  {0, 16, s}};
    for (const splid::Beside& beside : not_asked_for) splid::run_as_one(beside, trials);
  }
  const std::vector<splid::OtherPulse> pulses = {
      {"the configured pulse"},
      {"0.8 times as wide", 0.08},
      {"1.2 times as wide", 0.12},
      {"1.5 times as wide", 0.15},
      {"1.8 times as wide", 0.18},
      {"2 times as wide", 0.2},
      {"2.5 times as wide", 0.25},
      {"3 times as wide", 0.3},
      {"a tail of 0.1 ns", 0.1, 0.1},
      {"a tail of 0.15 ns", 0.1, 0.15},
      {"a tail of 0.2 ns", 0.1, 0.2},
      {"a tail of 0.3 ns", 0.1, 0.3},
      {"a tail of 0.5 ns", 0.1, 0.5},
      {"a sixth late by 0.13 ns", 0.1, 0.13, 1.0 / 6},
      {"of 13.5e-4, 1.3 times as wide", 0.13, 0, 0, s, 2},
      {"of 13.5e-4, 30 % late by 0.2 ns", 0.1, 0.2, 0.3, s, 2},
      {"of 13.5e-4, 30 % late by 0.3 ns", 0.1, 0.3, 0.3, s, 2},
      {"of 13.5e-4, 30 % late by 0.4 ns", 0.1, 0.4, 0.3, s, 2},
  };
  std::printf("\n| pulse | ok | several claimed |\n|---|---|---|\n");
  for (const splid::OtherPulse& pulse : pulses) {
    if (std::string(pulse.name).find(name) != std::string::npos) splid::run_shape(pulse, trials);
  }
}
