#include "protocol/file_kind.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string_view>

namespace splid {
namespace {

using namespace std::string_view_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string_view what(std::string_view start, std::string_view name = {}) {
  const auto kind = kind_of_file(start, name);
  return kind ? kind->what : "not known";
}

TEST(FileKind, IsToldByTheFirstBytes) {
  EXPECT_EQ(what("PQTTTR\0\0001.0.00"sv), "a PTU recording");
  EXPECT_THAT(what("PQHISTO\0"sv), HasSubstr("histogram"));
  EXPECT_THAT(what("PicoHarp 300\0"sv), HasSubstr(".pt2"));
  EXPECT_THAT(what("HydraHarp 400"sv), HasSubstr(".ht2"));
  EXPECT_THAT(what("TimeHarp 200"sv), HasSubstr(".t3r"));
  EXPECT_THAT(what("\x89HDF\r\n\x1a\n rest"sv), HasSubstr("an HDF5 file"));
  EXPECT_EQ(what("\x1f\x8b\x08\0"sv), "a gzip archive");
  EXPECT_EQ(what("PK\x03\x04"sv), "a ZIP archive");
  EXPECT_EQ(what("\xff\xd8\xff\xe0"sv), "a picture (JPEG)");
  EXPECT_EQ(what("\x89PNG\r\n\x1a\n"sv), "a picture (PNG)");
  EXPECT_EQ(what("%PDF-1.4"sv), "a document (PDF)");
}

TEST(FileKind, IsToldByTheSchemaOfJson) {
  EXPECT_EQ(what(R"({"schema":"splid.config","v":[1,0])"), "a splid configuration");
  EXPECT_EQ(what("\xef\xbb\xbf{ \"v\": [1,0],\n \"schema\" :\t\"splid.pattern\"}"),
            "a splid pattern");
  EXPECT_EQ(what(R"({"schema":"splid.truth")"), "the truth of a simulated scene");
  for (const char* text :
       {"{\"schema\"", "{\"schema\":", "{\"schema\":7}", "{\"schema\":\"splid.c"}) {
    EXPECT_EQ(what(text), "not known") << text;
  }
}

TEST(FileKind, IsToldByTheNameWhereNothingElseTells) {
  EXPECT_THAT(what("\x01\x02\x03", "folder/A.TTBIN"), HasSubstr("Swabian"));
  EXPECT_THAT(what("\x01\x02\x03", "a.spc"), HasSubstr("Becker"));
  EXPECT_EQ(what("PQTTTR", "a.spc"), "a PTU recording");
  EXPECT_EQ(what("", ""), "not known");
  EXPECT_THAT(what("\x01\x02\x03", "a.ts"), HasSubstr("S-Fifteen"));
  EXPECT_THAT(what("\x01\x02\x03", "a.SDT"), HasSubstr("Becker & Hickl file of measured curves"));
  EXPECT_THAT(misplaced_file("\x01", "a.sdt", "a recording"),
              HasSubstr("record again in the FIFO mode, as .spc"));
  EXPECT_THAT(what("*IDENT", "a.set"), HasSubstr("settings of a Becker & Hickl module"));
  EXPECT_EQ(what("hello", "a.txt"), "not known");
}

// What splid reads is to be looked at. What keeps each detection's time can become a PTU; what does
// not has to be recorded again.
TEST(FileKind, TheSentenceSaysWhetherAPtuInT2ModeCanBeMadeOfIt) {
  const auto next = [](std::string_view start, std::string_view name) {
    return misplaced_file(start, name, "a PTU recording in T2 mode");
  };
  EXPECT_THAT(next("\x01", "a.ttbin"), HasSubstr("FileReader"));
  EXPECT_THAT(next("\x01", "a.ttbin"), HasSubstr("make a PTU of that (docs/guide/recording.md"));
  for (const std::string_view name : {"a", "a.h5"}) {
    const std::string said = next("\x89HDF\r\n\x1a\n", name);
    EXPECT_THAT(said, HasSubstr("splid check says whether it is Photon-HDF5")) << name;
    EXPECT_THAT(said, HasSubstr("splid convert then makes a PTU of it")) << name;
  }
  // splid check has looked already, and would say the same again.
  EXPECT_THAT(next("hello", "a.h5"), AllOf(HasSubstr("without the mark that HDF5 begins with"),
                                           HasSubstr("copy it again")));
  for (const auto& [start, name] :
       {std::array{"TimeHarp 200"sv, "a.t3r"sv}, {"PQHISTO", "a"}, {"", "a.phu"}}) {
    EXPECT_THAT(next(start, name), HasSubstr("record again in T2 mode")) << name;
    EXPECT_THAT(next(start, name), HasSubstr("no program brings")) << name;
  }
  for (const auto& [start, name] : {std::array{"HydraHarp\0"sv, "A.HT2"sv},
                                    {"PicoHarp 300", "a"},
                                    {"\x01", "a.qutag"},
                                    {"", "a.spc"}}) {
    EXPECT_THAT(next(start, name), HasSubstr("splid check tells what is in it")) << name;
  }
}

TEST(FileKind, TheSentenceSaysWhatWasExpectedAndWhatToDo) {
  EXPECT_EQ(
      misplaced_file("\x1f\x8b", "a.json.gz", "a configuration"),
      "is a gzip archive, but a configuration is expected here; unpack it first, with gunzip");
  EXPECT_EQ(misplaced_file("hello", "a.json", "a configuration"), "");
}

}  // namespace
}  // namespace splid
