// Measures how far each value is off in the light of a detector with a dead time: with the dead
// time left out, and with the dead time modelled, over the same frames. Prints one row for each
// light, for docs/evidence/data/dead-time.csv. Then, for frames of 50 ms, light that is split
// unevenly over inputs, with and without the counts of each input; these rows are all named
// `split`. And for frames of 50 ms, light that varies within the frame; these rows are all named
// `flicker`.
//
//   dead_time [FRAMES [NAME]]    by default 1000 frames for each row; rows whose name has NAME

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "estimator/frame_estimator.hpp"
#include "estimator/likelihood/bound.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr int values = 4;

// Errors of delay, velocity, S and b, in deviations of the bound and in those that were published.
struct Errors {
  int frames = 0, found = 0, wrong = 0;
  std::array<double, values> sum = {}, squares = {}, inside = {};

  void add(const std::array<double, values>& error, const std::array<double, values>& bound,
           const std::array<double, values>& deviation) {
    for (std::size_t k = 0; k < values; ++k) {
      sum[k] += error[k] / bound[k];
      squares[k] += error[k] * error[k] / (bound[k] * bound[k]);
      inside[k] += std::abs(error[k]) < deviation[k] ? 1 : 0;
    }
    ++found;
  }
};

struct Row {
  const char* pattern;
  test::FrameMaker made;
  SceneOptions options = {};
};

double bound_or_one(double value) { return value > 0 && std::isfinite(value) ? value : 1; }

std::array<double, values> bound_of(const test::FrameMaker& made, double length_ns, double tau) {
  BoundScene scene;
  scene.length_ns = scene.seen_ns = length_ns;
  scene.delay_ns = tau;
  scene.velocity_mps = made.velocity_mps;
  scene.signal_per_pulse = made.signal_per_pulse;
  scene.background_per_ns = made.background_per_ns;
  scene.accelerating = made.acceleration_mps2 != 0;
  scene.detector = {made.dead_time_ns, static_cast<double>(made.inputs)};
  const Bound bound = cramer_rao_bound(made.pattern, *make_gaussian(made.sigma_ns), scene);
  return {bound_or_one(bound.delay_ns), bound_or_one(bound.velocity_mps),
          bound_or_one(bound.signal_per_pulse), bound_or_one(bound.background_per_ns)};
}

void run(const Row& row, int frames) {
  const test::FrameMaker& made = row.made;
  const double tau = 2 * made.distance_m / speed_of_light_mps * 1e9;
  const test::FrameMaker::Frame first = made.make(0);
  const auto bound = bound_of(made, static_cast<double>(first.end_ps - first.start_ps) * 1e-3, tau);
  const std::size_t most = 3 * first.photons_ps.size() + 1000;
  const DetectorOptions known = {made.dead_time_ns, DeadTime::modelled};
  const auto inputs = static_cast<std::size_t>(made.inputs);
  FrameEstimator left_out(made.pattern, {}, row.options, {}, made.length_ms, most);
  FrameEstimator modelled(made.pattern, {}, row.options, {}, made.length_ms, most,
                          ClockReference::tagger, known, inputs);
  std::array<Errors, 2> errors;
  double blind = 0;
  const double range_ns = made.pattern.unambiguous_delay_ps * 1e-3;
  for (int n = 0; n < frames; ++n) {
    const test::FrameMaker::Frame frame = made.make(static_cast<std::uint64_t>(n));
    for (int which = 0; which < 2; ++which) {
      const Estimate e = (which == 0 ? left_out : modelled).estimate(frame.view());
      Errors& sums = errors[static_cast<std::size_t>(which)];
      ++sums.frames;
      if (which == 1) blind += e.blind_fraction / frames;
      if (!e.has_values) continue;
      const double delay = std::remainder(e.delay_ns - tau, range_ns);
      sums.wrong += std::abs(delay) > 5 * made.sigma_ns ? 1 : 0;
      sums.add(
          {delay, e.velocity_mps - made.velocity_mps, e.signal_per_pulse - made.signal_per_pulse,
           e.background_per_ns - made.background_per_ns},
          bound,
          {e.std_delay_ns, e.std_velocity_mps, e.std_signal_per_pulse, e.std_background_per_ns});
    }
  }
  std::printf("| %s | %g | %g | %.3f |", row.pattern, made.signal_per_pulse,
              made.background_per_ns * made.dead_time_ns, blind);
  for (std::size_t which = 0; which < 2; ++which) {
    const Errors& sums = errors[which];
    const double found = std::max(1, sums.found);
    if (which == 1) std::printf(" %d, %d |", sums.found, sums.wrong);
    for (std::size_t k = 0; k < values; ++k) std::printf(" %+.2f", sums.sum[k] / found);
    std::printf(" |");
    if (which == 0) continue;
    for (std::size_t k = 0; k < values; ++k)
      std::printf(" %.3f", std::sqrt(sums.squares[k] / found));
    std::printf(" |");
    for (std::size_t k = 0; k < values; ++k) std::printf(" %.1f", 100 * sums.inside[k] / found);
    std::printf(" |");
  }
  std::printf("\n");
  std::fflush(stdout);
}

test::FrameMaker scene(const Pattern& pattern, double S, double in_a_dead_time, double dead_ns) {
  test::FrameMaker made;
  made.pattern = pattern;
  made.length_ms = 1;
  made.velocity_mps = 20;
  made.signal_per_pulse = S;
  made.background_per_ns = in_a_dead_time / dead_ns;
  made.dead_time_ns = dead_ns;
  return made;
}

// What the likelihood does not know, or only on average: afterpulses, and light that the inputs
// share unevenly.
Row with_afterpulses(Row row, double probability) {
  row.made.afterpulse_probability = probability;
  return row;
}

Row uneven(Row row, double first_share) {
  row.made.inputs = 2;
  row.made.first_share = first_share;
  return row;
}

// A path that curves by 13 pulse widths.
Row curved(Row row) {
  row.made.acceleration_mps2 = 4e5;
  row.options.motion = Motion::accelerating;
  row.options.max_acceleration_mps2 = 5e5;
  return row;
}

struct SplitRow {
  double S, in_a_dead_time, dead_ns, first_share;
  int inputs = 2;
};

// Mean errors of delay, S and b and their spread, all in the deviations that are published.
void run_split(const Pattern& pattern, const SplitRow& row, int frames) {
  test::FrameMaker made = scene(pattern, row.S, row.in_a_dead_time, row.dead_ns);
  made.length_ms = 50;
  made.inputs = row.inputs;
  made.first_share = row.first_share;
  const test::FrameMaker::Frame first = made.make(0);
  FrameEstimator estimator(pattern, {}, {}, {}, made.length_ms, 3 * first.photons_ps.size() + 1000,
                           ClockReference::tagger, {row.dead_ns, DeadTime::modelled},
                           static_cast<std::size_t>(row.inputs));
  std::printf("| split %g, %d | %g | %g | %g |", row.first_share, row.inputs, row.S,
              row.in_a_dead_time, row.dead_ns);
  const double tau = 2 * made.distance_m / speed_of_light_mps * 1e9;
  const double range_ns = pattern.unambiguous_delay_ps * 1e-3;
  double low = 0;  // by the split, in deviations of the signal
  for (const bool knows_counts : {false, true}) {
    Errors errors;
    low = 0;
    for (int n = 0; n < frames; ++n) {
      const test::FrameMaker::Frame frame = made.make(static_cast<std::uint64_t>(n));
      FrameView view = frame.view();
      if (!knows_counts) view.photons_of_input = {};
      const Estimate e = estimator.estimate(view);
      if (!e.has_values) continue;
      const std::array<double, values> deviation = {
          e.std_delay_ns, e.std_velocity_mps, e.std_signal_per_pulse, e.std_background_per_ns};
      errors.add({std::remainder(e.delay_ns - tau, range_ns), e.velocity_mps - made.velocity_mps,
                  e.signal_per_pulse - row.S, e.background_per_ns - made.background_per_ns},
                 deviation, deviation);
      low += e.low_by_split * e.signal_per_pulse / e.std_signal_per_pulse / frames;
    }
    const double found = std::max(1, errors.found);
    for (const std::size_t k : {0, 2, 3}) std::printf(" %+.2f", errors.sum[k] / found);
    std::printf(" |");
    for (const std::size_t k : {0, 2, 3}) {
      const double mean = errors.sum[k] / found;
      std::printf(" %.2f", std::sqrt(std::max(0.0, errors.squares[k] / found - mean * mean)));
    }
    std::printf(" |");
  }
  std::printf(" %.2f |\n", low);
  std::fflush(stdout);
}

void run_all_splits(const Pattern& pattern, int frames) {
  std::printf(
      "\n| first's share, inputs | S | b t_d | t_d, ns | counts not known: mean error of delay, S, "
      "b | spread | counts known: mean error | spread | S is reported low by |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  for (const SplitRow& row :
       {SplitRow{0.5, 0.1, 50, 0.5}, SplitRow{0.5, 0.1, 50, 0.55}, SplitRow{0.5, 0.1, 50, 0.7},
        SplitRow{0.5, 0.1, 50, 0.9}, SplitRow{0.5, 0.04, 20, 0.7}, SplitRow{0.5, 0.1, 50, 0.4, 4},
        SplitRow{0.02, 0.1, 50, 0.7}, SplitRow{0.1, 1, 50, 0.7}, SplitRow{0.1, 3, 50, 0.7},
        SplitRow{1, 0.1, 50, 0.7}, SplitRow{3, 0.1, 50, 0.55}, SplitRow{3, 0.1, 50, 0.7}}) {
    run_split(pattern, row, frames);
  }
}

struct FlickerRow {
  double S, in_a_dead_time, signal_swing, background_swing, hz = 200;
};

void run_flicker(const Pattern& pattern, const FlickerRow& row, int frames) {
  test::FrameMaker made = scene(pattern, row.S, row.in_a_dead_time, 50);
  made.length_ms = 50;
  made.signal_swing = row.signal_swing;
  made.background_swing = row.background_swing;
  made.swing_hz = row.hz;
  const test::FrameMaker::Frame first = made.make(0);
  FrameEstimator estimator(pattern, {}, {}, {}, made.length_ms, 3 * first.photons_ps.size() + 1000,
                           ClockReference::tagger, {50, DeadTime::modelled});
  const double tau = 2 * made.distance_m / speed_of_light_mps * 1e9;
  const double range_ns = pattern.unambiguous_delay_ps * 1e-3;
  Errors errors;
  int said = 0;
  for (int n = 0; n < frames; ++n) {
    made.start_ps = n * std::int64_t{50'000'000'000};
    const test::FrameMaker::Frame frame = made.make(static_cast<std::uint64_t>(n));
    const Estimate e = estimator.estimate(frame.view());
    if (!e.has_values) continue;
    const std::array<double, values> deviation = {e.std_delay_ns, e.std_velocity_mps,
                                                  e.std_signal_per_pulse, e.std_background_per_ns};
    errors.add({std::remainder(e.delay_ns - tau, range_ns), e.velocity_mps - made.velocity_mps,
                e.signal_per_pulse - row.S, e.background_per_ns - made.background_per_ns},
               deviation, deviation);
    said += e.findings.all().empty() ? 0 : 1;
  }
  const double found = std::max(1, errors.found);
  std::printf("| flicker | %g | %g | %.0f, %.0f | %g |", row.S, row.in_a_dead_time,
              100 * row.signal_swing / std::sqrt(2), 100 * row.background_swing / std::sqrt(2),
              row.hz);
  for (const std::size_t k : {0, 2, 3}) std::printf(" %+.2f", errors.sum[k] / found);
  std::printf(" | %.0f |\n", 100 * said / found);
  std::fflush(stdout);
}

void run_all_flickers(const Pattern& pattern, int frames) {
  std::printf(
      "\n| row | S | b t_d | varies by, %%: signal, background | at, Hz | mean error of delay, S, "
      "b "
      "| with a finding, %% |\n|---|---|---|---|---|---|---|\n");
  for (const FlickerRow& row :
       {FlickerRow{0.02, 0.1, 0, 0}, FlickerRow{0.02, 0.1, 0.5, 0},
        FlickerRow{0.02, 0.1, 0, 0.5, 100}, FlickerRow{0.02, 1, 0, 0},
        FlickerRow{0.02, 1, 0, 0.1, 100}, FlickerRow{0.02, 1, 0, 0.5, 100},
        FlickerRow{0.1, 3, 0, 0}, FlickerRow{0.1, 3, 0.5, 0}, FlickerRow{0.5, 0.1, 0, 0},
        FlickerRow{0.5, 0.1, 0.1, 0}, FlickerRow{0.5, 0.1, 0.2, 0}, FlickerRow{0.5, 0.1, 0.5, 0},
        FlickerRow{0.5, 0.1, 0.5, 0, 2000}, FlickerRow{0.5, 0.1, 0.5, 0, 10000},
        FlickerRow{3, 0.1, 0, 0}, FlickerRow{3, 0.1, 0.1, 0}, FlickerRow{3, 0.1, 0.2, 0},
        FlickerRow{3, 0.1, 0.5, 0}}) {
    run_flicker(pattern, row, frames);
  }
}

}  // namespace
}  // namespace splid

int main(int count, char** arguments) {
  using namespace splid;
  const int frames = count > 1 ? std::atoi(arguments[1]) : 1000;
  const char* name = count > 2 ? arguments[2] : "";
  if (frames <= 0) {
    std::fprintf(stderr, "usage: dead_time [FRAMES [NAME]]\n");
    return 2;
  }
  const Pattern interleaved = test::interleaved_pattern({180000, 189000}, 3780000);
  const Pattern random = test::random_pattern(3780000, 40, 9000, 5);
  const Pattern one = test::periodic_pattern(100000);
  std::printf(
      "%d frames for each row; errors in deviations of the bound of the same detector:\n"
      "delay, velocity, S, b.\n\n",
      frames);
  std::printf(
      "| pattern | S | b t_d | blind | mean error, left out | found, wrong | mean error, "
      "modelled | RMSE over bound | inside one deviation, %% |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  for (const Row& row :
       {Row{"interleaved", scene(interleaved, 0.02, 1e-3, 50)},
        Row{"interleaved", scene(interleaved, 0.02, 0.1, 50)},
        Row{"interleaved", scene(interleaved, 0.1, 1, 50)},
        Row{"interleaved", scene(interleaved, 0.1, 3, 50)},
        Row{"interleaved", scene(interleaved, 0.5, 0.1, 50)},
        Row{"interleaved", scene(interleaved, 3, 0.1, 50)},
        Row{"interleaved", scene(interleaved, 3, 3, 50)},
        Row{"random", scene(random, 0.5, 0.3, 22)},
        Row{"random", scene(random, 3, 1, 50)},
        Row{"one pulse", scene(one, 0.02, 0.1, 50)},
        Row{"one pulse", scene(one, 1, 0.3, 50)},
        Row{"one pulse", scene(one, 3, 3, 250)},
        Row{"interleaved", scene(interleaved, 3, 10, 50)},
        Row{"one pulse", scene(one, 10, 0.1, 50)},
        curved({"interleaved", scene(interleaved, 0.1, 1, 50)}),
        curved({"interleaved", scene(interleaved, 3, 0.1, 50)}),
        with_afterpulses({"1 % afterpulses", scene(interleaved, 0.02, 0.1, 50)}, 0.01),
        with_afterpulses({"1 % afterpulses", scene(interleaved, 0.5, 0.1, 50)}, 0.01),
        with_afterpulses({"5 % afterpulses", scene(interleaved, 0.5, 0.1, 50)}, 0.05),
        with_afterpulses({"5 % afterpulses", scene(interleaved, 3, 3, 50)}, 0.05),
        uneven({"inputs 50 : 50", scene(interleaved, 0.5, 0.1, 50)}, 0.5),
        uneven({"inputs 55 : 45", scene(interleaved, 0.5, 0.1, 50)}, 0.55),
        uneven({"inputs 70 : 30", scene(interleaved, 0.5, 0.1, 50)}, 0.7),
        uneven({"inputs 70 : 30", scene(interleaved, 0.02, 0.1, 50)}, 0.7)}) {
    if (std::string(row.pattern).find(name) != std::string::npos) run(row, frames);
  }
  if (std::string("split").find(name) != std::string::npos) run_all_splits(interleaved, frames);
  if (std::string("flicker").find(name) != std::string::npos) run_all_flickers(interleaved, frames);
}
