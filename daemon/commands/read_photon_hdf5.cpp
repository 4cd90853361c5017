#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "daemon/commands/commands.hpp"
#include "daemon/recording/photon_hdf5_pipe.hpp"

namespace splid {

// What splid convert and splid check start, in a process that may crash without them. Nobody types
// it, so no help names it.
void add_read_photon_hdf5(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("read-photon-hdf5", "")->group("");
  const auto file = std::make_shared<std::string>();
  command->add_option("file", *file)->required();
  command->callback([&action, file] {
    action = [file] {
      recording::write_photon_hdf5(*file, STDOUT_FILENO);
      return 0;
    };
  });
}

}  // namespace splid
