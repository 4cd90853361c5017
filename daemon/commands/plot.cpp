#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "daemon/base/log.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/draw_plot.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

struct PlotCommand {
  std::string file;
  std::string config;
  std::string output;
};

int plot(PlotCommand options) {
  if (::access(options.file.c_str(), R_OK) != 0) {
    throw Error(Fault::data, options.file + ": " + std::generic_category().message(errno));
  }
  require_seekable(options.file);
  if (options.output.empty()) {
    options.output = std::filesystem::path(options.file).replace_extension(".png").string();
  }
  check_folder_of(options.output);
  std::vector<std::string> arguments = {"file", options.file};
  if (!options.config.empty()) arguments.push_back(options.config);
  arguments.push_back(options.output);
  if (const auto failed = try_to_draw(arguments)) throw Error(*failed);
  log_info("the picture is in {}", options.output);
  return 0;
}

}  // namespace

void add_plot(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "plot",
      "Draw a table of frames, a recording, a calibrated pattern or a tradeoff, with Python");
  const auto options = std::make_shared<PlotCommand>();
  command->add_option("file", options->file, "Table, recording, pattern or tradeoff to draw")
      ->required();
  command->add_option("--config,-c", options->config,
                      "Measure the recording with this configuration and draw the frames (default: "
                      "draw its rates, and the photons between two syncs)");
  command->add_option("--output,-o", options->output,
                      "Picture to write: .svg, .png or .pdf (default: the file's name with .png)");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return plot(*options); }; });
}

}  // namespace splid
