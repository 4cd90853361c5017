#include "daemon/commands/device_places.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/sockets/listening_socket.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

std::vector<std::string> words_of(const std::vector<DevicePlace>& places) {
  std::vector<std::string> words;
  for (const DevicePlace& each : places) {
    words.push_back(each.place + " | " + each.reader + " | " + each.what);
  }
  return words;
}

TEST(DevicePlaces, AreNoneBelowAFolderThatIsNotThere) {
  EXPECT_TRUE(socket_places("/nowhere").empty());
}

TEST(DevicePlaces, AreTheSocketsOfBridges) {
  const test::TempFolder folder;
  std::vector<sockets::ListeningSocket> listening;
  for (const std::string name : {"splid-bridge-idq", "splid-bridge-a", "splid", "other"}) {
    std::filesystem::create_directory(folder.path(name));
    const std::string file = name == "splid" ? "/bridge.sock" : "/tags.sock";
    listening.emplace_back("listen", "ipc://" + folder.path(name + file), "");
  }
  std::filesystem::create_directory(folder.path("splid-bridge-none"));
  EXPECT_THAT(
      words_of(socket_places(std::filesystem::path(folder.path("a")).parent_path().string())),
      ::testing::ElementsAre(::testing::EndsWith("/splid-bridge-a/tags.sock | driver bridge | "),
                             ::testing::EndsWith("/splid-bridge-idq/tags.sock | driver bridge | "),
                             ::testing::EndsWith("/splid/bridge.sock | driver bridge | ")));
}

TEST(DevicePlaces, AreWhatConfigurationsName) {
  const test::TempFolder folder;
  const std::string bridge = folder.write(
      "idq-bridge.json",
      R"({"schema":"splid.bridge.idq","listen":"unix:/a","address":"tcp:10.0.0.5:5555"})");
  const std::string config = folder.write(
      "splid.json",
      R"({"schema":"splid.config","source":{"driver":"bridge","address":"tcp:10.0.0.6:9880"}})");
  const std::string own =
      folder.write("own.json", R"({"schema":"splid.config","source":{"driver":"simulator"}})");
  const std::string none = folder.write("none.json", "no JSON");
  EXPECT_THAT(words_of(configured_places({bridge, config, own, none, "/nowhere.json"})),
              ::testing::ElementsAre("tcp:10.0.0.5:5555 | splid bridge idq | in " + bridge,
                                     "unix:/a | driver bridge | in " + bridge,
                                     "tcp:10.0.0.6:9880 | driver bridge | in " + config));
}

}  // namespace
}  // namespace splid
