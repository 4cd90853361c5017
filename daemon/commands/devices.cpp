#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/device_places.hpp"
#include "daemon/commands/try_device.hpp"

namespace splid {
namespace {

struct DevicesCommand {
  bool all = false;
  std::vector<std::string> configs = {"/etc/splid/splid.json", "/etc/splid/idq-bridge.json"};
  std::string tried;
  double seconds = 5;
};

std::vector<DevicePlace> all_places(const DevicesCommand& options) {
  std::vector<DevicePlace> places = usb_places(options.all);
  const auto add = [&places](const std::vector<DevicePlace>& more) {
    for (const DevicePlace& each : more) {
      const bool is_there =
          std::any_of(places.begin(), places.end(),
                      [&each](const DevicePlace& place) { return place.place == each.place; });
      if (!is_there) places.push_back(each);
    }
  };
  add(socket_places("/run"));
  add(configured_places(options.configs));
  return places;
}

int list_devices(const DevicesCommand& options) {
  const std::vector<DevicePlace> places = all_places(options);
  if (places.empty()) {
    std::fprintf(stderr, "no %s is plugged in, no bridge runs, and no configuration names one%s\n",
                 options.all ? "USB device" : "known USB instrument",
                 options.all ? "" : "; splid devices --all lists all USB devices");
    return 0;
  }
  bool closed = false;
  std::size_t widest = 0;
  for (const DevicePlace& each : places) widest = std::max(widest, each.place.size());
  fmt::print("{:{}}  {:22}  what\n", "place", widest, "read by");
  for (const DevicePlace& each : places) {
    fmt::print("{:{}}  {:22}  {}{}\n", each.place, widest, each.reader.empty() ? "-" : each.reader,
               each.what, each.is_closed ? "  (no permission)" : "");
    closed = closed || each.is_closed;
  }
  std::fflush(stdout);
  if (closed) {
    std::fprintf(
        stderr,
        "(no permission): join the group splid; of a USB device of your own, put a line for its "
        "id into /etc/udev/rules.d/60-splid.rules as in systemd/60-splid.rules, and plug it in "
        "again\n");
  }
  return 0;
}

}  // namespace

void add_devices(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("devices", "List instruments, bridges and what reads each, or try one");
  const auto options = std::make_shared<DevicesCommand>();
  command->add_flag("--all", options->all,
                    "List all USB devices; the driver tags16-usb may read any");
  command->add_option("--config,-c", options->configs,
                      "Configurations of splid and of bridges whose instruments are listed, too");
  command->add_option("--try", options->tried,
                      "Count the tags of the instrument at this place, and print a configuration");
  command->add_option("--seconds", options->seconds, "How long to count, s")
      ->check(CLI::Range(0.1, 3600.0));
  add_log_options(*command);
  command->callback([&action, options] {
    action = [options] {
      return options->tried.empty() ? list_devices(*options)
                                    : try_device(options->tried, options->seconds);
    };
  });
}

}  // namespace splid
