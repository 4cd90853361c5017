
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "config/config.hpp"
#include "config/read_file.hpp"
#include "daemon/base/text.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/recording/photon_hdf5_reader.hpp"
#include "daemon/recording/recording_report.hpp"
#include "daemon/security/allow_list.hpp"
#include "daemon/service/memory.hpp"
#include "daemon/service/start_check.hpp"
#include "daemon/study/calibration/side_lobe_report.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "protocol/error.hpp"
#include "protocol/file_kind.hpp"
#include "protocol/pattern_json.hpp"
#include "protocol/recording_format.hpp"
#include "protocol/shown_text.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

// As much of a file as tells its format.
constexpr std::size_t start_bytes = 64;

struct CheckCommand {
  std::vector<std::string> files;
  bool schema = false;
};

constexpr const char* checked_kinds = "a configuration, a pattern or a recording";

// Whether a text begins like JSON. The JSON parser accepts a byte order mark before the brace.
bool begins_with_brace(std::string_view text) {
  text = without_byte_order_mark(text);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

void say_side_lobe(const Pattern& pattern, const PulseOptions& pulse, double length_ms) {
  const std::string hardest =
      calibration::describe_side_lobe(pattern, *calibration::shape_of(pattern, pulse), length_ms);
  if (!hardest.empty()) std::printf("  ranges   %s\n", hardest.c_str());
}

void check_pattern(const std::string& file, const std::string& text) {
  const Pattern pattern = pattern_from_json(text, file);
  std::printf("%s: a pattern: %s%s%s\n", shown_text(file, most_said).c_str(),
              describe_pattern(pattern).c_str(),
              pattern.calibrated_period_ps ? ", calibrated period" : "",
              pattern.pulse ? ", measured pulse shape" : "");
  PulseOptions pulse;
  if (pattern.pulse) pulse.shape = Shape::tabulated;
  say_side_lobe(pattern, pulse, FrameOptions().length_ms);
}

void check_config(const std::string& file) {
  const Config config = load_config_aloud(file);
  check_start(config);
  const std::string name = shown_text(file, most_said);
  std::printf(
      "%s: a configuration\n  source   %s\n  pattern  %s: %s\n  frame    %g ms\n  publish  %s\n"
      "  memory   about %.0f MiB\n",
      name.c_str(), config.source_driver.c_str(),
      shown_text(config.pattern_file, most_said).c_str(), describe_pattern(config.pattern).c_str(),
      config.frame.length_ms, shown_text(config.publish.endpoint, most_said).c_str(),
      memory_needed_mib(config));
  if (!config.pixels.empty()) std::printf("  pixels   %zu\n", config.pixels.size());
  say_side_lobe(config.pattern, config.pulse, config.frame.length_ms);
  for (const std::string& note : start_notes(config)) {
    std::fprintf(stderr, "splid: warning: %s: %s\n", name.c_str(),
                 shown_text(note, most_said).c_str());
  }
  if (config.security.allow_list.empty()) return;
  const std::size_t keys = security::AllowList::read(config.security.allow_list).size();
  std::printf("  allowed  %zu keys of %s\n", keys,
              shown_text(config.security.allow_list, most_said).c_str());
}

// For what splid cannot read at all.
[[noreturn]] void refuse(const std::string& file, const std::string& text) {
  std::string what = misplaced_file(text, file, checked_kinds);
  if (text.empty()) {
    what = "is empty: nothing was recorded into it, or it was not copied whole";
  } else if (what.empty()) {
    what = "is neither a configuration or pattern (JSON) nor a recording; " +
           std::string(recordings_in_words) +
           " (these last two by the name alone); see docs/guide/recording.md, \"Files that splid "
           "cannot read\"";
  }
  throw Error(Fault::data, file + ": " + what);
}

// Whether a text is none that people name files by, but a place of `splid devices` or the name of
// an instrument.
bool is_an_instruments(const std::string& text) {
  return text.starts_with("unix:") || text.starts_with("tcp:") ||
         text.find_first_of("./") == std::string::npos;
}

void check_file(const std::string& file) {
  std::error_code unknown;
  if (!std::filesystem::exists(file, unknown) && is_an_instruments(file)) {
    throw Error(Fault::usage,
                file +
                    ": there is no file of that name; check takes files; an instrument is tried "
                    "by splid devices --try PLACE, with a place that splid devices lists");
  }
  if (std::filesystem::is_directory(file, unknown)) {
    throw Error(
        Fault::usage,
        file + ": is a folder; check takes files, and batch measures all recordings of a folder");
  }
  require_seekable(file);
  const std::string start = read_start(file, start_bytes);
  if (!start.empty() && format_of(start, file)) {
    std::fputs(shown_lines(recording::report_of(file)).c_str(), stdout);
    return;
  }
  if (recording::begins_as_hdf5(file)) {
    std::fputs(shown_lines(recording::report_photon_hdf5(file)).c_str(), stdout);
    return;
  }
  // What is no JSON may be a recording of any size, and its first bytes tell enough of it.
  const std::string text = begins_with_brace(start) ? read_file(file) : start;
  const auto kind = kind_of_file(text, file);
  if (kind == pattern_file_kind) {
    check_pattern(file, text);
  } else if (kind == config_file_kind || begins_with_brace(text)) {
    check_config(file);
  } else {
    refuse(file, text);
  }
}

// Looks at every file. Of several, the exit code is that of the first that is wrong.
int check(const CheckCommand& options) {
  if (options.schema) {
    std::printf("%s\n", config_schema().c_str());
    return 0;
  }
  if (options.files.empty()) throw Error(Fault::usage, "check needs a FILE, or --schema");
  if (options.files.size() == 1) {
    check_file(options.files.front());
    return 0;
  }
  int code = 0;
  for (const std::string& file : options.files) {
    try {
      check_file(file);
    } catch (const Error& error) {
      std::fprintf(stderr, "splid: error: %s\n", shown_text(error.what(), most_said).c_str());
      if (code == 0) code = error.exit_code();
    }
  }
  return code;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "check", "Show contents and errors of a configuration, pattern or recording");
  const auto options = std::make_shared<CheckCommand>();
  command->add_option("files", options->files, "Configurations, patterns and recordings");
  command->add_flag("--schema", options->schema, "Print the JSON schema of the configuration");
  command->callback([&action, options] { action = [options] { return check(*options); }; });
}

}  // namespace splid
