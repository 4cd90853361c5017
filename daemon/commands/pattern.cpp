#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/study/calibration/side_lobe_report.hpp"
#include "protocol/pattern_json.hpp"
#include "protocol/pattern_make.hpp"
#include "protocol/pattern_side_lobes.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

constexpr double ps_per_ns = 1000;

struct PatternCommand {
  std::string output;
  std::vector<double> subperiods_ns;
  double period_ns = 3780;
  std::size_t pulses = 40;
  std::size_t periodic_pulses = 1;
  double min_spacing_ns = 9;
  std::uint64_t seed = 1;
  bool stratified = false;
  bool ambiguous = false;
  std::vector<std::int64_t> repeats;
};

std::vector<double> in_ps(std::vector<double> times_ns) {
  for (double& time : times_ns) time *= ps_per_ns;
  return times_ns;
}

int write_pattern(const Pattern& pattern, const std::string& file) {
  check_is_pattern_or_new(file);
  write_file(file, to_json_file(pattern));
  const std::string name = shown_text(file, most_said);
  std::fprintf(stderr, "%s: %s\n", name.c_str(), describe_pattern(pattern).c_str());
  if (const auto lobe = highest_side_lobe(pattern)) {
    std::fprintf(stderr,
                 "%s: highest side lobe of its autocorrelation: %zu of %zu pulses (%.3g %%) within "
                 "%g ps at a shift of %.10g ns\n",
                 name.c_str(), lobe->pairs, pulses_per_period(pattern), 100 * lobe->relative,
                 side_lobe_window_ps, lobe->shift_ps / ps_per_ns);
  }
  const std::string hardest =
      calibration::describe_side_lobe(pattern, *calibration::shape_of(pattern, {}), 0);
  if (!hardest.empty()) {
    std::fprintf(stderr, "%s: %s (pulses of 100 ps, background as in the default scene)\n",
                 name.c_str(), hardest.c_str());
  }
  return 0;
}

CLI::App* add_kind(CLI::App& pattern, const char* name, const char* doc, PatternCommand& options,
                   Action& action, Pattern (*make)(const PatternCommand&)) {
  CLI::App* kind = pattern.add_subcommand(name, doc);
  kind->add_option("--output,-o", options.output, "Pattern file to write")->required();
  kind->callback([&options, &action, make] {
    action = [&options, make] { return write_pattern(make(options), options.output); };
  });
  return kind;
}

Pattern interleaved(const PatternCommand& options) {
  return make_interleaved(in_ps(options.subperiods_ns));
}

Pattern random(const PatternCommand& options) {
  const RandomPatternOptions random{options.period_ns * ps_per_ns, options.pulses,
                                    options.min_spacing_ns * ps_per_ns, options.seed};
  return options.stratified ? make_stratified(random) : make_random(random);
}

Pattern periodic(const PatternCommand& options) {
  return make_periodic(options.ambiguous ? Mode::ambiguous : Mode::baseline,
                       options.period_ns * ps_per_ns, options.periodic_pulses);
}

Pattern mrr(const PatternCommand& options) {
  std::vector<std::int64_t> repeats = options.repeats;
  if (repeats.size() == 1) repeats.resize(options.subperiods_ns.size(), repeats.front());
  return make_mrr(in_ps(options.subperiods_ns), repeats);
}

void add_kinds(CLI::App& pattern, PatternCommand& options, Action& action) {
  CLI::App* kind = add_kind(pattern, "interleaved", "Superposed pulse trains of several periods",
                            options, action, interleaved);
  kind->add_option("--subperiods-ns", options.subperiods_ns,
                   "Periods of the trains, ns, such as 180,189")
      ->delimiter(',')
      ->required();
  kind = add_kind(pattern, "random", "Random pulse times with a least spacing", options, action,
                  random);
  kind->add_option("--period-ns", options.period_ns, "Period of the pattern, ns")
      ->capture_default_str();
  kind->add_option("--pulses", options.pulses, "Pulses in a period")
      ->check(whole_number())
      ->capture_default_str();
  kind->add_option("--min-spacing-ns", options.min_spacing_ns, "Least spacing of the pulses, ns")
      ->capture_default_str();
  kind->add_option("--seed", options.seed, "Seed of the random times")
      ->check(whole_number())
      ->capture_default_str();
  kind->add_flag("--stratified", options.stratified, "Place one pulse in each of equal slots");
  kind = add_kind(pattern, "periodic", "Evenly spaced pulses", options, action, periodic);
  kind->add_option("--period-ns", options.period_ns, "Period of the pattern, ns")
      ->capture_default_str();
  kind->add_option("--pulses", options.periodic_pulses, "Pulses in a period")
      ->check(whole_number())
      ->capture_default_str();
  kind->add_flag("--ambiguous", options.ambiguous,
                 "Mark the range as ambiguous: targets may be beyond it");
  kind = add_kind(pattern, "mrr", "Several repetition rates in turn", options, action, mrr);
  kind->add_option("--periods-ns", options.subperiods_ns,
                   "Periods of the trains, ns, such as 180,189")
      ->delimiter(',')
      ->required();
  kind->add_option("--repeats", options.repeats, "Pulses of each rate, or one number for all")
      ->delimiter(',')
      ->required();
}

}  // namespace

void add_pattern(CLI::App& app, Action& action) {
  CLI::App* pattern = app.add_subcommand("pattern", "Make a pattern file");
  pattern->require_subcommand(1);
  const auto options = std::make_shared<PatternCommand>();
  // The command refers to the options, so this callback keeps them alive as long as the command.
  pattern->parse_complete_callback([options] {});
  add_kinds(*pattern, *options, action);
}

}  // namespace splid
