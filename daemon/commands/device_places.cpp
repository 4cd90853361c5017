#include "daemon/commands/device_places.hpp"

#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "config/read_file.hpp"
#include "drivers/usb/known_devices.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"

namespace splid {
namespace {

constexpr const char* bridge_driver = "driver bridge";

std::string text_member(const nlohmann::json& object, const char* key) {
  const auto member = object.is_object() ? object.find(key) : object.end();
  return member != object.end() && member->is_string() ? member->get<std::string>() : "";
}

nlohmann::json document_of(const std::string& file) {
  try {
    return json_value_if_any(read_file(file));
  } catch (const Error&) {
    return nullptr;
  }
}

void add_socket(const std::string& path, std::vector<DevicePlace>& places) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISSOCK(info.st_mode)) return;
  const bool is_closed = ::access(path.c_str(), R_OK | W_OK) != 0;
  places.push_back({"unix:" + path, bridge_driver, "", is_closed});
}

}  // namespace

std::vector<DevicePlace> usb_places(bool all) {
  std::vector<DevicePlace> places;
  for (const usb::KnownDevice& each : usb::known_devices(all)) {
    const usb::DeviceInfo& info = each.info;
    std::string what = to_string(info.id);
    if (!each.instrument.empty()) what += " " + each.instrument;
    if (!info.serial.empty()) what += ", serial " + info.serial;
    if (info.speed_mbit_s > 0) what += fmt::format(", {} Mbit/s", info.speed_mbit_s);
    const std::string reader = each.driver.empty() ? each.bridge : "driver " + each.driver;
    places.push_back({fmt::format("{:03}:{:03}", info.bus, info.address), reader, what,
                      !each.may_open && each.bridge.empty()});
  }
  return places;
}

std::vector<DevicePlace> socket_places(const std::string& folder) {
  std::vector<DevicePlace> places;
  add_socket(folder + "/splid/bridge.sock", places);
  std::error_code absent;
  for (const auto& entry : std::filesystem::directory_iterator(folder, absent)) {
    const std::string path = entry.path().string();
    if (!entry.path().filename().string().starts_with("splid-bridge-")) continue;
    add_socket(path + "/tags.sock", places);
  }
  const auto is_before = [](const DevicePlace& a, const DevicePlace& b) {
    return a.place < b.place;
  };
  std::sort(places.begin(), places.end(), is_before);
  return places;
}

std::vector<DevicePlace> configured_places(const std::vector<std::string>& files) {
  const std::string bridge_schema = "splid.bridge.";
  std::vector<DevicePlace> places;
  const auto add = [&places](const std::string& place, const std::string& reader,
                             const std::string& file) {
    if (!place.empty()) places.push_back({place, reader, "in " + file, false});
  };
  for (const std::string& file : files) {
    const nlohmann::json document = document_of(file);
    const std::string schema = text_member(document, "schema");
    if (schema.starts_with(bridge_schema)) {
      add(text_member(document, "address"), "splid bridge " + schema.substr(bridge_schema.size()),
          file);
      add(text_member(document, "listen"), bridge_driver, file);
    } else if (schema == "splid.config" && document.contains("source")) {
      add(text_member(document["source"], "address"), bridge_driver, file);
    }
  }
  return places;
}

}  // namespace splid
