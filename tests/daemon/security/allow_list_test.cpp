#include "daemon/security/allow_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::security {
namespace {

using testing::HasSubstr;

const std::string one = "Yne@$w-vo<fVvi]a<NY6T1ed:M$fCG*[IaLV{hID";
const std::string other = std::string(40, '1');

std::string fault_of(const std::string& text) {
  return test::error_text([&] { AllowList::parse(text, "list"); });
}

TEST(AllowList, NamesEachKey) {
  const AllowList list = AllowList::parse(
      "# who may read\n\n#\n" + one + " viewer\r\n  " + other + "\tlab 2, left \n", "list");
  EXPECT_EQ(list.size(), 2u);
  EXPECT_EQ(list.name_of(one), "viewer");
  EXPECT_EQ(list.name_of(other), "lab 2, left");
  EXPECT_EQ(list.name_of(std::string(40, '0')), std::nullopt);
  EXPECT_EQ(list.name_of(""), std::nullopt);
  EXPECT_EQ(AllowList::parse(one + " x", "list").size(), 1u) << "without a newline at the end";
}

TEST(AllowList, LetsNobodyInWhereItIsEmpty) {
  for (const char* text : {"", "\n", "# none\n"}) EXPECT_EQ(AllowList::parse(text, "l").size(), 0u);
  EXPECT_EQ(AllowList{}.name_of(one), std::nullopt);
}

TEST(AllowList, ALineThatIsNoneIsAnErrorWithItsPlace) {
  EXPECT_THAT(fault_of("# x\nviewer " + one),
              HasSubstr("list:2: does not begin with a public key"));
  EXPECT_EQ(fault_of("#" + one + " off"), "");
  EXPECT_THAT(fault_of(one), HasSubstr("list:1: has no name"));
  EXPECT_THAT(fault_of(one + " \t"), HasSubstr("has no name"));
  EXPECT_THAT(fault_of(one + " " + std::string(65, 'x')), HasSubstr("1 to 64"));
  EXPECT_EQ(fault_of(one + " " + std::string(64, 'x')), "");
  EXPECT_THAT(fault_of(one + " a\x1b[2J"), HasSubstr("printable"));
  EXPECT_THAT(fault_of(one + " first\n" + one + " second"),
              HasSubstr("list:2: has the key of first again"));
}

TEST(AllowList, CountsWhatAnotherLacks) {
  const AllowList both = AllowList::parse(one + " a\n" + other + " b", "list");
  const AllowList renamed = AllowList::parse(one + " c", "list");
  EXPECT_EQ(both.missing_in(renamed), 1u);
  EXPECT_EQ(renamed.missing_in(both), 0u);
}

TEST(AllowList, IsReadFromAFileThatNobodyElseCanWrite) {
  const test::TempFolder folder;
  const std::string file = folder.write("allowed", one + " viewer\n");
  std::filesystem::permissions(file, std::filesystem::perms{0644});
  EXPECT_EQ(AllowList::read(file).name_of(one), "viewer");
  std::filesystem::permissions(file, std::filesystem::perms{0666});
  EXPECT_THAT(test::error_text([&] { AllowList::read(file); }), HasSubstr("mode 0666"));
}

}  // namespace
}  // namespace splid::security
