#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "config/bridge_config.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/service/bridging.hpp"
#include "daemon/sockets/message_client.hpp"
#include "drivers/idq/options.hpp"
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

// No call of it hangs: each answer is waited for in slices.
int bridge_idq(const std::string& file) {
  idq::Options options;
  options.open_socket = sockets::message_clients();
  const std::string listen = load_bridge_config(file, "idq", options);
  return run_bridge(listen, [&options](const SourceContext& context) {
    return BridgedInstrument{options.open(context), [] { return std::string(); }};
  });
}

void add_maker(CLI::App& bridge, Action& action, const char* name, const char* instruments,
               int (*run)(const std::string&)) {
  CLI::App* maker = bridge.add_subcommand(name, instruments);
  const auto file = std::make_shared<std::string>();
  maker->add_option("--config,-c", *file, "Configuration file of the bridge")->required();
  add_log_options(*maker);
  maker->callback([&action, file, run] { action = [file, run] { return run(*file); }; });
}

}  // namespace

void add_bridge(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "bridge", "Read an instrument through its maker's library or program, for splid run");
  command->require_subcommand(1);
  add_maker(*command, action, "picoquant",
            "Read a MultiHarp, HydraHarp 400, TimeHarp 260 or PicoHarp 300", bridge_picoquant);
  add_maker(*command, action, "idq", "Read an ID900 or ID1000 Time Controller of ID Quantique",
            bridge_idq);
}

}  // namespace splid
