#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/model/options.hpp"
#include "protocol/pattern.hpp"

namespace splid::studies {

// What is studied: a figure of [P] at [P]'s own settings, or more than [P] shows.
enum class Study { fig2, fig3, fig4, fig5, fig5_whole, fig9, any, velocities, experiment };

// The quantity that a study sweeps over, which is the figure's horizontal axis.
enum class Axis { background, length, velocity, signal };

struct StudyInfo {
  Study study;
  std::string_view name;   // on the command line and in the tables
  std::string_view title;  // a sentence for the tables
  Axis axis;
  double ratio_to_reach;  // RMSE over the bound, of delay and velocity
  bool as_paper;          // the settings are those of [P]
};

const std::vector<StudyInfo>& all_studies();
const StudyInfo& info(Study study);
std::optional<Study> study_from_name(std::string_view name);

// How a frame is estimated.
enum class Estimator {
  search,       // by splid's own method, which claims no target where none is significant
  paper,        // by the whole method of [P], with the mixed-integer program as remainder theorem
  paper_start,  // the start of the former, which is not refined; for Fig. 5 alone
  wang,         // as `paper`, but with the theorem of Wang et al. 2015; for Fig. 5 alone
  wang_start,   // the start of the former; for Fig. 5 alone
};

const std::vector<Estimator>& all_estimators();
const char* to_string(Estimator estimator);
std::optional<Estimator> estimator_from_name(std::string_view name);

// One point of a figure: a scene, of which each trial draws its own frame.
struct Cell {
  Study study = Study::fig2;
  Mode mode = Mode::baseline;
  Effort effort = Effort::balanced;  // of the search
  double length_ms = 0.5;
  double signal_per_pulse = 0.01;
  double background_per_ns = 1e-3;
  std::optional<double> velocity_mps = {};  // absent: each trial draws its own within +-150 m/s
};

constexpr double pulse_sigma_ns = 0.1;
constexpr double max_speed_mps = 150;

// The round trip at the frame's start, which the study gives. Absent: each trial draws its own,
// uniform over the unambiguous range.
std::optional<double> delay_start_ns(Study study);

// A cell and an estimator, which are run together and have a row of their own in the results.
struct Job {
  Cell cell;
  Estimator estimator = Estimator::search;
  int trials = 0;
};

// The text that tells one job from another, whatever their trials: the first columns of the CSV.
std::string scene_key(const Cell& cell);
std::string key(const Job& job);

// The pattern that the study gives this mode; frames of MRR show as many pulses of each period.
Pattern pattern_of(const Cell& cell);

// t_a: of [P]'s simulations its own, of others the whole number of pattern periods that comes
// nearest to it, as the daemon cuts frames. Of MRR it is the pattern's one period.
double frame_length_ns(const Cell& cell);

// All jobs of all studies, in the order of the tables.
std::vector<Job> full_jobs(int trials);
// A few jobs, whose search takes less than a minute in all.
std::vector<Job> quick_jobs(int trials);

}  // namespace splid::studies
