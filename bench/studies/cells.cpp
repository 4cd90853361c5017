#include "bench/studies/cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include "estimator/model/units.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/pattern_make.hpp"

namespace splid::studies {
namespace {

// [P]'s simulations, and its experiment.
constexpr double simulation_period_ps = 2'600'000;
constexpr std::size_t simulation_pulses = 50;
constexpr std::array simulation_periods_ps = {100'000.0, 104'000.0};
constexpr double experiment_period_ps = 3'780'000;
constexpr std::size_t experiment_pulses = 40;
constexpr std::array experiment_periods_ps = {180'000.0, 189'000.0};
// [P] Fig. 5: periods whose least common multiple is 34,665.3 ns, and the least distance to the
// pulse before, ten pulse widths.
constexpr std::array fig5_periods_ps = {99'900.0, 104'100.0};
constexpr double fig5_spacing_ps = 1'000;
constexpr double ps_per_ms = 1e9;

constexpr double simulation_mps = 30;
constexpr double simulation_delay_ns = 1077;
constexpr double experiment_m = 284.5357;

constexpr std::array four_modes = {Mode::baseline, Mode::mrr, Mode::random, Mode::interleaved};
constexpr std::array five_modes = {Mode::baseline, Mode::ambiguous, Mode::mrr, Mode::random,
                                   Mode::interleaved};
constexpr std::array moving_modes = {Mode::mrr, Mode::random, Mode::interleaved};
constexpr std::array fig9_lengths_ms = {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0};

// 1e-5 to 1e-2 counts/ns, two a decade, to three digits.
constexpr std::array backgrounds_per_ns = {1e-5, 3.16e-5, 1e-4, 3.16e-4, 1e-3, 3.16e-3, 1e-2};

bool is_experiment(Study study) {
  return study == Study::fig9 || study == Study::velocities || study == Study::experiment;
}

// As many pulses of each period, as [P] has them: as many as the frame holds whole.
Pattern mrr(std::span<const double> periods, double length_ms) {
  const double one_of_each_ps = std::accumulate(periods.begin(), periods.end(), 0.0);
  const auto repeats = static_cast<std::int64_t>(length_ms * ps_per_ms / one_of_each_ps + 1e-6);
  return make_mrr(periods, std::vector(periods.size(), repeats));
}

// Without the pulses that are too near to the one before.
Pattern thinned(Pattern pattern, double spacing_ps) {
  PatternSegment& segment = pattern.segments.front();
  std::vector<double> kept;
  for (const double time_ps : segment.pulse_times_ps) {
    if (kept.empty() || time_ps - kept.back() >= spacing_ps) kept.push_back(time_ps);
  }
  segment.pulse_times_ps = kept;
  segment.amplitudes.assign(kept.size(), 1);
  return pattern;
}

// 10,000 pulses: the frame's length is that of their periods.
double fig3_length_ms(Mode mode) {
  constexpr double pulses = 10'000;
  constexpr double mean_period_ps = (simulation_periods_ps[0] + simulation_periods_ps[1]) / 2;
  if (mode == Mode::baseline) return pulses * simulation_period_ps / ps_per_ms;
  if (mode == Mode::mrr) return pulses * mean_period_ps / ps_per_ms;
  return pulses / simulation_pulses * simulation_period_ps / ps_per_ms;
}

std::vector<Cell> against_background(Study study, std::span<const Mode> modes) {
  std::vector<Cell> cells;
  for (const Mode mode : modes) {
    for (const double background : backgrounds_per_ns) {
      cells.push_back({.study = study,
                       .mode = mode,
                       .background_per_ns = background,
                       .velocity_mps = simulation_mps});
    }
  }
  return cells;
}

std::vector<Cell> fig2() { return against_background(Study::fig2, four_modes); }

std::vector<Cell> fig3() {
  std::vector<Cell> cells = against_background(Study::fig3, four_modes);
  for (Cell& cell : cells) cell.length_ms = fig3_length_ms(cell.mode);
  return cells;
}

std::vector<Cell> fig4() {
  std::vector<Cell> cells;
  for (const Mode mode : {Mode::random, Mode::interleaved}) {
    for (int v = 0; v <= 100; v += 10) {
      cells.push_back({.study = Study::fig4,
                       .mode = mode,
                       .length_ms = 10,
                       .signal_per_pulse = 1e-4,
                       .background_per_ns = 1e-5,
                       .velocity_mps = v});
    }
  }
  return cells;
}

std::vector<Cell> fig5(Study study) {
  return against_background(study, std::array{Mode::interleaved});
}

Cell experiment_cell(Study study, Mode mode) {
  return {.study = study,
          .mode = mode,
          .length_ms = 50,
          .signal_per_pulse = 13.5e-4,
          .background_per_ns = 1.75e-4};
}

// [P] Table 1.
double table1_signal_per_pulse(Mode mode) {
  switch (mode) {
    case Mode::baseline:
      return 4.03e-4;
    case Mode::ambiguous:
      return 13.6e-4;
    case Mode::mrr:
      return 14.0e-4;
    case Mode::random:
      return 13.2e-4;
    case Mode::interleaved:
      break;
  }
  return 13.8e-4;
}

double table1_background_per_ns(Mode mode) {
  return mode == Mode::mrr || mode == Mode::random ? 1.74e-4 : 1.75e-4;
}

std::vector<Cell> fig9() {
  std::vector<Cell> cells;
  for (const Mode mode : five_modes) {
    for (const double length : fig9_lengths_ms) {
      cells.push_back({.study = Study::fig9,
                       .mode = mode,
                       .length_ms = length,
                       .signal_per_pulse = table1_signal_per_pulse(mode),
                       .background_per_ns = table1_background_per_ns(mode),
                       .velocity_mps = 0});
    }
  }
  return cells;
}

// The scenes of Fig. 2 at any delay and velocity.
std::vector<Cell> any() {
  std::vector<Cell> cells = against_background(Study::any, four_modes);
  for (Cell& cell : cells) cell.velocity_mps = {};
  return cells;
}

// The experiment's light in 10 ms, in which 25 m/s are 17 pulse widths.
std::vector<Cell> velocities() {
  std::vector<Cell> cells;
  for (const Mode mode : moving_modes) {
    for (int v = -150; v <= 150; v += 50) {
      Cell cell = experiment_cell(Study::velocities, mode);
      cell.length_ms = 10;
      cell.velocity_mps = v;
      cells.push_back(cell);
    }
  }
  return cells;
}

// The experiment at any velocity, with less and less signal.
std::vector<Cell> experiment() {
  std::vector<Cell> cells;
  for (const Mode mode : {Mode::random, Mode::interleaved}) {
    Cell cell = experiment_cell(Study::experiment, mode);
    cells.push_back(cell);
    cell.signal_per_pulse = 2e-4;
    cells.push_back(cell);
    cell.signal_per_pulse = 1.5e-4;
    cells.push_back(cell);
  }
  return cells;
}

std::vector<Cell> cells_of(Study study) {
  switch (study) {
    case Study::fig2:
      return fig2();
    case Study::fig3:
      return fig3();
    case Study::fig4:
      return fig4();
    case Study::fig5:
    case Study::fig5_whole:
      return fig5(study);
    case Study::fig9:
      return fig9();
    case Study::any:
      return any();
    case Study::velocities:
      return velocities();
    case Study::experiment:
      break;
  }
  return experiment();
}

bool has_starts(Study study) { return study == Study::fig5 || study == Study::fig5_whole; }

void add_jobs(const Cell& cell, int trials, int other_trials, std::vector<Job>& jobs) {
  for (const Estimator estimator : all_estimators()) {
    const bool of_every_study = estimator == Estimator::search || estimator == Estimator::paper;
    if (!of_every_study && !has_starts(cell.study)) continue;
    jobs.push_back({cell, estimator, estimator == Estimator::search ? trials : other_trials});
  }
}

// The cell of a study that a quick run looks at.
bool is_quick(const Cell& cell) {
  switch (info(cell.study).axis) {
    case Axis::background:
      return cell.background_per_ns == 1e-3;
    case Axis::length:
      return cell.length_ms == 50;
    case Axis::velocity:
      return cell.velocity_mps == 100;
    case Axis::signal:
      break;
  }
  return cell.mode == Mode::random && cell.signal_per_pulse == 13.5e-4;
}

}  // namespace

const std::vector<StudyInfo>& all_studies() {
  static const std::vector<StudyInfo> studies = {
      {Study::fig2, "fig2", "[P] Fig. 2: four modes against background", Axis::background, 1.05,
       true},
      {Study::fig3, "fig3", "[P] Fig. 3: 10,000 pulses against background", Axis::background, 1.05,
       true},
      {Study::fig4, "fig4", "[P] Fig. 4: few photons against velocity", Axis::velocity, 1.15, true},
      {Study::fig5, "fig5", "[P] Fig. 5: 99.9 and 104.1 ns, delays modulo 2600 ns",
       Axis::background, 1.05, true},
      {Study::fig5_whole, "fig5-whole", "[P] Fig. 5 with delays up to 34,665.3 ns",
       Axis::background, 1.05, true},
      {Study::fig9, "fig9", "[P] Fig. 9 and Table 1: the experiment at rest", Axis::length, 1.05,
       true},
      {Study::any, "any", "The scenes of Fig. 2 at any delay and velocity", Axis::background, 1.05,
       false},
      {Study::velocities, "velocities", "The experiment's light in 10 ms against velocity",
       Axis::velocity, 1.05, false},
      {Study::experiment, "experiment", "The experiment at any velocity, with less and less signal",
       Axis::signal, 1.05, false},
  };
  return studies;
}

const StudyInfo& info(Study study) { return all_studies()[static_cast<std::size_t>(study)]; }

std::optional<Study> study_from_name(std::string_view name) {
  for (const StudyInfo& one : all_studies()) {
    if (one.name == name) return one.study;
  }
  return std::nullopt;
}

const std::vector<Estimator>& all_estimators() {
  static const std::vector<Estimator> all = {Estimator::search, Estimator::paper,
                                             Estimator::paper_start, Estimator::wang,
                                             Estimator::wang_start};
  return all;
}

const char* to_string(Estimator estimator) {
  switch (estimator) {
    case Estimator::search:
      return "search";
    case Estimator::paper:
      return "paper";
    case Estimator::paper_start:
      return "paper-start";
    case Estimator::wang:
      return "wang";
    case Estimator::wang_start:
      return "wang-start";
  }
  return "";
}

std::optional<Estimator> estimator_from_name(std::string_view name) {
  for (const Estimator one : all_estimators()) {
    if (to_string(one) == name) return one;
  }
  return std::nullopt;
}

std::optional<double> delay_start_ns(Study study) {
  if (study == Study::fig9) return 2 * experiment_m / speed_of_light_mps * 1e9;
  if (info(study).as_paper) return simulation_delay_ns;
  return std::nullopt;
}

std::string scene_key(const Cell& cell) {
  std::string text(info(cell.study).name);
  text += std::string(",") + splid::to_string(cell.mode);
  text += std::string(",") + splid::to_string(cell.effort);
  text += "," + number_text(cell.length_ms);
  text += "," + number_text(cell.signal_per_pulse);
  text += "," + number_text(cell.background_per_ns);
  return text + "," + (cell.velocity_mps ? number_text(*cell.velocity_mps) : "any");
}

std::string key(const Job& job) { return scene_key(job.cell) + "," + to_string(job.estimator); }

Pattern pattern_of(const Cell& cell) {
  const bool experiment = is_experiment(cell.study);
  const double period_ps = experiment ? experiment_period_ps : simulation_period_ps;
  const std::span<const double> periods_ps =
      experiment ? experiment_periods_ps : simulation_periods_ps;
  switch (cell.mode) {
    case Mode::baseline:
      return make_periodic(Mode::baseline, period_ps);
    case Mode::ambiguous:
      return make_periodic(Mode::ambiguous, period_ps, experiment_pulses);
    case Mode::mrr:
      return mrr(periods_ps, cell.length_ms);
    case Mode::random:
      if (experiment) return make_random({});
      return make_stratified({.period_ps = period_ps, .pulses = simulation_pulses});
    case Mode::interleaved:
      break;
  }
  if (!has_starts(cell.study)) return make_interleaved(periods_ps);
  Pattern pattern = thinned(make_interleaved(fig5_periods_ps), fig5_spacing_ps);
  if (cell.study == Study::fig5) pattern.unambiguous_delay_ps = simulation_period_ps;
  return pattern;
}

double frame_length_ns(const Cell& cell) {
  const double period_ns = pattern_period_ps(pattern_of(cell)) * ns_per_ps;
  const double length_ns = cell.length_ms * 1e6;
  const bool is_simulation = info(cell.study).as_paper && !is_experiment(cell.study);
  if (is_simulation && cell.mode != Mode::mrr) return length_ns;
  return std::round(length_ns / period_ns) * period_ns;
}

std::vector<Job> full_jobs(int trials) {
  std::vector<Job> jobs;
  for (const StudyInfo& study : all_studies()) {
    for (const Cell& cell : cells_of(study.study)) add_jobs(cell, trials, trials, jobs);
  }
  return jobs;
}

std::vector<Job> quick_jobs(int trials) {
  // The search is judged. Of the other estimators it is enough to see that they run.
  const int other_trials = std::max(1, trials / 20);
  std::vector<Job> jobs;
  for (const StudyInfo& study : all_studies()) {
    for (const Cell& cell : cells_of(study.study)) {
      if (is_quick(cell)) add_jobs(cell, trials, other_trials, jobs);
    }
  }
  return jobs;
}

}  // namespace splid::studies
