#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "daemon/commands/commands.hpp"
#include "drivers/usb/known_devices.hpp"

namespace splid {
namespace {

const char* or_dash(const std::string& text) { return text.empty() ? "-" : text.c_str(); }

int list_devices(bool all) {
  bool closed = false;
  int shown = 0;
  for (const usb::KnownDevice& each : usb::known_devices(all)) {
    const usb::DeviceInfo& info = each.info;
    const std::string speed =
        info.speed_mbit_s > 0 ? fmt::format("{} Mbit/s", info.speed_mbit_s) : "-";
    if (shown++ == 0) std::printf("bus:dev id         speed         driver  serial\n");
    std::printf("%03d:%03d %s  %-12s  %-6s  %s%s\n", info.bus, info.address,
                to_string(info.id).c_str(), speed.c_str(), or_dash(each.driver),
                or_dash(info.serial), each.may_open ? "" : "  (no permission)");
    closed = closed || !each.may_open;
  }
  if (shown == 0) {
    std::fprintf(stderr, "no %s is plugged in%s\n", all ? "USB device" : "known USB instrument",
                 all ? "" : "; splid devices --all lists all USB devices");
  }
  if (closed) {
    std::fprintf(
        stderr,
        "(no permission): put a line for its id into /etc/udev/rules.d/60-splid.rules as in "
        "systemd/60-splid.rules, join the group splid and plug it in again\n");
  }
  return 0;
}

}  // namespace

void add_devices(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("devices", "List the USB instruments that are plugged in");
  const auto all = std::make_shared<bool>(false);
  command->add_flag("--all", *all, "List all USB devices; the driver tags16-usb may read any");
  command->callback([&action, all] { action = [all] { return list_devices(*all); }; });
}

}  // namespace splid
