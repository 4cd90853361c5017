#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "config/config.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/format.hpp"
#include "daemon/memory.hpp"
#include "daemon/read_file.hpp"
#include "daemon/recording/recording_report.hpp"
#include "daemon/security/allow_list.hpp"
#include "protocol/error.hpp"
#include "protocol/pattern_json.hpp"

namespace splid {
namespace {

constexpr const char* ptu_magic = "PQTTTR";
constexpr std::size_t ptu_magic_bytes = 6;

struct CheckCommand {
  std::string file;
  bool schema = false;
};

// The value of "schema", empty where the text has none; not judged here.
std::string schema_of(const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("schema") || !json["schema"].is_string()) return {};
  return json["schema"].get<std::string>();
}

void check_pattern(const std::string& file, const std::string& text) {
  const Pattern pattern = pattern_from_json(text, file);
  std::printf("%s: a pattern: %s%s%s\n", file.c_str(), describe_pattern(pattern).c_str(),
              pattern.calibrated_period_ps ? ", calibrated period" : "",
              pattern.pulse ? ", measured pulse shape" : "");
}

void check_config(const std::string& file) {
  const Config config = load_config(file);
  std::printf(
      "%s: a configuration\n  source   %s\n  pattern  %s: %s\n  frame    %g ms\n  publish  %s\n"
      "  memory   about %.0f MiB\n",
      file.c_str(), config.source_driver.c_str(), config.pattern_file.c_str(),
      describe_pattern(config.pattern).c_str(), config.frame.length_ms,
      config.publish.endpoint.c_str(), memory_needed_mib(config));
  // Not the key: where systemd puts it, it is while the service runs alone.
  if (config.security.allow_list.empty()) return;
  const std::size_t keys = AllowList::read(config.security.allow_list).size();
  std::printf("  allowed  %zu keys of %s\n", keys, config.security.allow_list.c_str());
}

int check(const CheckCommand& options) {
  if (options.schema) {
    std::printf("%s\n", config_schema().c_str());
    return 0;
  }
  if (options.file.empty()) throw Error(Fault::usage, "check needs a FILE, or --schema");
  if (read_start(options.file, ptu_magic_bytes) == ptu_magic) {
    std::fputs(report_recording(options.file).c_str(), stdout);
    return 0;
  }
  const std::string text = read_file(options.file);
  if (schema_of(text) == "splid.pattern") {
    check_pattern(options.file, text);
  } else if (text.find_first_not_of(" \t\r\n") != std::string::npos &&
             text[text.find_first_not_of(" \t\r\n")] == '{') {
    check_config(options.file);
  } else {
    throw Error(Fault::data, options.file +
                                 ": neither a configuration or a pattern (JSON) nor a PTU "
                                 "recording (which starts with PQTTTR)");
  }
  return 0;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("check", "Say what is in a configuration, pattern or PTU recording");
  const auto options = std::make_shared<CheckCommand>();
  command->add_option("file", options->file, "File to look at");
  command->add_flag("--schema", options->schema, "Print the JSON schema of the configuration");
  command->callback([&action, options] { action = [options] { return check(*options); }; });
}

}  // namespace splid
