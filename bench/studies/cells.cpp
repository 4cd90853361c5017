#include "bench/studies/cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "estimator/model/pattern_make.hpp"
#include "protocol/json_writer.hpp"

namespace splid::studies {
namespace {

constexpr double even_period_ps = 3'780'000;
constexpr std::array interleaved_periods_ps = {180'000.0, 189'000.0};
// The periods of [P] Fig. 5, which have no small common multiple, as a CRT for whole numbers needs
// it.
constexpr std::array fig5_periods_ps = {99'900.0, 104'100.0};
constexpr double ps_per_ms = 1e9;

constexpr std::array five_modes = {Mode::baseline, Mode::ambiguous, Mode::mrr, Mode::random,
                                   Mode::interleaved};
constexpr std::array moving_modes = {Mode::mrr, Mode::random, Mode::interleaved};
constexpr std::array lengths_ms = {0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0};
constexpr std::array fig9_lengths_ms = {10.0, 20.0, 50.0, 100.0, 200.0};

// 1e-5 to 1e-2 counts/ns, two a decade, to three digits.
constexpr std::array backgrounds_per_ns = {1e-5, 3.16e-5, 1e-4, 3.16e-4, 1e-3, 3.16e-3, 1e-2};

Pattern mrr(std::span<const double> periods, double length_ms) {
  std::vector<std::int64_t> repeats;
  for (const double period : periods) {
    const double share = length_ms * ps_per_ms / static_cast<double>(periods.size());
    repeats.push_back(std::llround(share / period));
  }
  return make_mrr(periods, repeats);
}

std::vector<Cell> fig2() {
  std::vector<Cell> cells;
  for (const Mode mode : five_modes) {
    for (const double background : backgrounds_per_ns) {
      cells.push_back({.study = Study::fig2, .mode = mode, .background_per_ns = background});
    }
  }
  return cells;
}

std::vector<Cell> fig3() {
  std::vector<Cell> cells;
  for (const Mode mode : five_modes) {
    for (const double length : lengths_ms) {
      cells.push_back({.study = Study::fig3, .mode = mode, .length_ms = length});
    }
  }
  return cells;
}

Cell experiment_cell(Study study, Mode mode) {
  return {.study = study,
          .mode = mode,
          .length_ms = 50,
          .signal_per_pulse = 13.5e-4,
          .background_per_ns = 1.75e-4};
}

std::vector<Cell> against_velocity(Cell cell) {
  std::vector<Cell> cells;
  for (const Mode mode : moving_modes) {
    for (int v = -150; v <= 150; v += 25) {
      cell.mode = mode;
      cell.velocity_mps = v;
      cells.push_back(cell);
    }
  }
  return cells;
}

std::vector<Cell> fig4() { return against_velocity({.study = Study::fig4, .length_ms = 0.1}); }

// In 0.1 ms 150 m/s are 0.1 ns, one pulse width, which a matched filter at rest still finds; in
// 10 ms they are 100 widths, and 25 m/s are 17.
std::vector<Cell> fig4_long() {
  Cell cell = experiment_cell(Study::fig4_long, Mode::random);
  cell.length_ms = 10;
  return against_velocity(cell);
}

std::vector<Cell> fig5() {
  std::vector<Cell> cells;
  cells.reserve(backgrounds_per_ns.size());
  for (const double background : backgrounds_per_ns) {
    // The remainders of the two periods differ by multiples of 0.3 ns, their common divisor. In
    // 0.5 ms, as in Fig. 2, that is 6.6 deviations of their difference: one frame in 1000 would be
    // lost to any method. In 2 ms it is 13.
    cells.push_back(
        {.study = Study::fig5, .mode = Mode::mrr, .length_ms = 2, .background_per_ns = background});
  }
  return cells;
}

std::vector<Cell> fig9() {
  std::vector<Cell> cells;
  for (const double length : fig9_lengths_ms) {
    Cell cell = experiment_cell(Study::fig9, Mode::interleaved);
    cell.length_ms = length;
    cell.velocity_mps = 0;
    cells.push_back(cell);
  }
  return cells;
}

// A study of splid's own: any velocity, and less and less signal.
std::vector<Cell> experiment() {
  std::vector<Cell> cells;
  for (const Mode mode : {Mode::random, Mode::interleaved}) {
    Cell cell = experiment_cell(Study::experiment, mode);
    cells.push_back(cell);
    cell.signal_per_pulse = 2e-4;
    cells.push_back(cell);
    cell.signal_per_pulse = 1.5e-4;
    cell.effort = Effort::exhaustive;
    cells.push_back(cell);
  }
  return cells;
}

void add_jobs(const Cell& cell, int trials, int other_trials, std::vector<Job>& jobs) {
  jobs.push_back({cell, Estimator::search, trials});
  jobs.push_back({cell, Estimator::paper, other_trials});
  if (cell.study == Study::fig5) jobs.push_back({cell, Estimator::wang, other_trials});
}

}  // namespace

const std::vector<StudyInfo>& all_studies() {
  static const std::vector<StudyInfo> studies = {
      {Study::fig2, "fig2", "[P] Fig. 2: five modes against background", Axis::background, 1.05},
      {Study::fig3, "fig3", "[P] Fig. 3: five modes against acquisition time", Axis::length, 1.05},
      {Study::fig4, "fig4", "[P] Fig. 4: few photons, against velocity", Axis::velocity, 1.15},
      {Study::fig4_long, "fig4-10ms", "As [P] Fig. 4 in 10 ms with the experiment's light",
       Axis::velocity, 1.05},
      {Study::fig5, "fig5", "[P] Fig. 5: MRR with 99.9 and 104.1 ns against background",
       Axis::background, 1.05},
      {Study::fig9, "fig9", "[P] Fig. 9 and Table 1: the experiment at rest", Axis::length, 1.05},
      {Study::experiment, "experiment", "The experiment at any velocity, with less and less signal",
       Axis::signal, 1.05},
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

const char* to_string(Estimator estimator) {
  switch (estimator) {
    case Estimator::search:
      return "search";
    case Estimator::paper:
      return "paper";
    case Estimator::wang:
      return "wang";
  }
  return "";
}

std::optional<Estimator> estimator_from_name(std::string_view name) {
  for (const Estimator one : {Estimator::search, Estimator::paper, Estimator::wang}) {
    if (to_string(one) == name) return one;
  }
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
  switch (cell.mode) {
    case Mode::baseline:
      return make_periodic(Mode::baseline, even_period_ps);
    case Mode::ambiguous:
      return make_periodic(Mode::ambiguous, even_period_ps, 40);
    case Mode::mrr:
      if (cell.study == Study::fig5) return mrr(fig5_periods_ps, cell.length_ms);
      return mrr(interleaved_periods_ps, cell.length_ms);
    case Mode::random:
      return make_random({});
    case Mode::interleaved:
      break;
  }
  return make_interleaved(interleaved_periods_ps);
}

std::vector<Job> full_jobs(int trials) {
  std::vector<Job> jobs;
  for (const auto make : {fig2, fig3, fig4, fig4_long, fig5, fig9, experiment}) {
    for (const Cell& cell : make()) add_jobs(cell, trials, trials, jobs);
  }
  return jobs;
}

std::vector<Job> quick_jobs(int trials) {
  // The search is judged. Of the other estimators it is enough to see that they run.
  const int other_trials = std::max(1, trials / 20);
  std::vector<Job> jobs;
  for (const Cell& cell : fig2()) {
    if (cell.background_per_ns == 1e-3) add_jobs(cell, trials, other_trials, jobs);
  }
  for (const Cell& cell : fig3()) {
    if (cell.length_ms == 5) add_jobs(cell, trials, other_trials, jobs);
  }
  for (const Cell& cell : fig4()) {
    if (cell.velocity_mps == 100) add_jobs(cell, trials, other_trials, jobs);
  }
  for (const Cell& cell : fig5()) {
    if (cell.background_per_ns == 1e-3) add_jobs(cell, trials, other_trials, jobs);
  }
  for (const Cell& cell : fig9()) {
    if (cell.length_ms == 50) add_jobs(cell, trials, other_trials, jobs);
  }
  add_jobs(experiment().front(), trials, other_trials, jobs);
  return jobs;
}

}  // namespace splid::studies
