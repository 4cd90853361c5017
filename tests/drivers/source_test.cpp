#include "drivers/source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <set>

#include "tests/support/matches.hpp"

namespace splid {
namespace {

TEST(Source, DriversAreFoundByName) {
  EXPECT_THAT(source_names(), testing::IsSupersetOf({"replay", "simulator"}));
  EXPECT_NE(make_source_options("replay"), nullptr);
  EXPECT_EQ(make_source_options("no such driver"), nullptr);
}

// "3137:200a" of all devices that some driver registered.
std::set<std::string> registered_ids() {
  std::set<std::string> ids;
  for (const std::string& name : source_names()) {
    for (const usb::Id& id : usb_ids_of(name)) ids.insert(to_string(id));
  }
  return ids;
}

// The ids, in small letters, whose vendor and product `line_of_id` finds in lines of the file that
// are no remarks.
std::set<std::string> ids_in(const std::string& file, const std::string& line_of_id) {
  std::ifstream lines(SPLID_SOURCE_DIR "/systemd/" + file);
  std::set<std::string> ids;
  for (std::string line; std::getline(lines, line);) {
    const auto found = test::first_match(line, line_of_id);
    if (line.starts_with('#') || found.empty()) continue;
    std::string id = found[1] + ':' + found[2];
    std::transform(id.begin(), id.end(), id.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    ids.insert(id);
  }
  return ids;
}

TEST(Source, UsbIdsStandInTheRegistration) {
  EXPECT_THAT(usb_ids_of("tdc2"), testing::Contains(usb::Id{0x3137, 0x200a}));
  EXPECT_TRUE(usb_ids_of("tags16-usb").empty());
  EXPECT_TRUE(usb_ids_of("no such driver").empty());
}

// A driver with a new id needs a line of this form in each of the two files.
TEST(Source, TheUdevRuleGivesAccessToTheDevicesThatDriversRegistered) {
  EXPECT_EQ(ids_in("60-splid.rules",
                   R"re(^ATTR\{idVendor\}=="([0-9a-f]{4})", ATTR\{idProduct\}=="([0-9a-f]{4})", )re"
                   R"re(GROUP="splid", MODE="0660", TAG\+="uaccess"$)re"),
            registered_ids());
}

TEST(Source, ThePackageIsOfferedToWhoeverPlugsInWhatDriversRegistered) {
  EXPECT_EQ(ids_in("org.example.splid.metainfo.xml",
                   R"(<modalias>usb:v([0-9A-F]{4})p([0-9A-F]{4})d\*</modalias>)"),
            registered_ids());
}

}  // namespace
}  // namespace splid
