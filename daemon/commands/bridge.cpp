#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "config/bridge_config.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/service/bridging.hpp"
#include "drivers/picoquant/source.hpp"

namespace splid {
namespace {

int bridge_picoquant(const std::string& file) {
  picoquant::Options options;
  const std::string listen = load_bridge_config(file, "picoquant", options);
  return run_bridge(listen, [&options](const SourceContext& context) {
    auto source = std::make_unique<picoquant::Source>(options, context);
    const picoquant::Source& watched = *source;
    return BridgedInstrument{std::move(source), [&watched] { return watched.overdue_call(); }};
  });
}

}  // namespace

void add_bridge(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("bridge", "Read an instrument through its maker's library, for splid run");
  command->require_subcommand(1);
  CLI::App* picoquant = command->add_subcommand(
      "picoquant", "MultiHarp, HydraHarp 400, TimeHarp 260 or PicoHarp 300");
  const auto file = std::make_shared<std::string>();
  picoquant->add_option("--config,-c", *file, "Configuration file of the bridge")->required();
  add_log_options(*picoquant);
  picoquant->callback([&action, file] { action = [file] { return bridge_picoquant(*file); }; });
}

}  // namespace splid
