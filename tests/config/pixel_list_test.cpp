#include "config/pixel_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "config/path_list.hpp"
#include "protocol/pattern_json.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class PixelListTest : public ::testing::Test {
 protected:
  PixelListTest() {
    folder_.write("patterns/p.json", to_json_file(make_interleaved(std::array{180e3, 189e3})));
  }

  std::string write(const std::string& sections, const std::string& source) {
    return folder_.write("c.json", R"({"schema": "splid.config", "v": [1, 0], "source": )" +
                                       source + R"(, "pattern": {"file": "patterns/p.json"}, )" +
                                       sections + "}");
  }

  Config load(const std::string& sections) {
    return load_config(write(sections, R"({"driver": "simulator"})"));
  }

  // What is wrong, behind the name of the configuration.
  std::string error_of(const std::string& sections,
                       const std::string& source = R"({"driver": "simulator"})") {
    const std::string file = write(sections, source);
    const std::string text = test::error_text([&] { load_config(file); });
    return text.starts_with(file + ": ") ? text.substr(file.size() + 2) : text;
  }

  static std::string list_of(std::size_t count) {
    std::string list;
    for (std::size_t i = 0; i < count; ++i) {
      list += (i == 0 ? "" : ",") + std::string(R"({"input": )") + std::to_string(i) + "}";
    }
    return R"("pixels": [)" + list + "]";
  }

  test::TempFolder folder_;
};

const PixelOptions first{"a1", 3, -2, 0.5, 120, 40, 90};
const PixelOptions second{"-1", -1, {}, {}, 0, {}, {}};

TEST_F(PixelListTest, IsInTheConfiguration) {
  const Config config = load(R"("pixels": [{"name": "a1", "input": 3, "azimuth_deg": -2,
      "elevation_deg": 0.5, "delay_ps": 120, "dead_time_ns": 40, "sigma_ps": 90}, {"input": -1}])");
  EXPECT_THAT(config.pixels, ElementsAre(first, second));
  EXPECT_EQ(config.pixels_file, "");
}

TEST_F(PixelListTest, IsAbsentWhereThereIsOnePixel) {
  const Config config = load(R"("frame": {"length_ms": 50})");
  EXPECT_THAT(config.pixels, ElementsAre());
  EXPECT_THAT(config_to_json(config), Not(HasSubstr("pixels")));
}

TEST_F(PixelListTest, IsInAFileOfJson) {
  folder_.write("field.json", R"([{"name": "a1", "input": 3, "azimuth_deg": -2,
      "elevation_deg": 0.5, "delay_ps": 120, "dead_time_ns": 40, "sigma_ps": 90}, {"input": -1}])");
  const Config config = load(R"("pixels": "field.json")");
  EXPECT_THAT(config.pixels, ElementsAre(first, second));
  EXPECT_EQ(config.pixels_file, folder_.path("field.json"));
  EXPECT_EQ(input_files(config).at(1).pointer, "/pixels");
  EXPECT_EQ(input_files(config).at(1).path, folder_.path("field.json"));
}

TEST_F(PixelListTest, IsInAFileOfCsv) {
  folder_.write(
      "field.csv",
      "\xef\xbb\xbfname, input,azimuth_deg,elevation_deg,delay_ps,dead_time_ns,sigma_ps\r\n"
      "\"a1\",3,-2,0.5,120,40,90\r\n\r\n,-1,,,,,\n");
  EXPECT_THAT(load(R"("pixels": "field.csv")").pixels, ElementsAre(first, second));
}

TEST_F(PixelListTest, ReadsBackAsItIsShown) {
  const Config config = load(R"("pixels": [{"name": "a1", "input": 3, "azimuth_deg": -2,
      "elevation_deg": 0.5, "delay_ps": 120, "dead_time_ns": 40, "sigma_ps": 90}, {"input": -1}])");
  const std::string file = folder_.write("shown.json", config_to_json(config));
  EXPECT_EQ(load_config(file).pixels, config.pixels);
}

TEST_F(PixelListTest, TakesThePlaceOfThePhotonInputs) {
  EXPECT_EQ(error_of(R"("pixels": [{"input": 1}], "channels": {"photon": 1})"),
            "/channels/photon: is given, and /pixels too, which takes its place; remove one of the "
            "two");
  EXPECT_THAT(error_of(R"("pixels": [{"input": 1}], "channels": {"delays_ps": [1]})"),
              HasSubstr("/channels/delays_ps: is given"));
}

TEST_F(PixelListTest, SaysWhatIsWrong) {
  EXPECT_EQ(error_of(R"("pixels": [{"input": 1}, {"name": "b", "input": 1}])"),
            "/pixels/1/input: 1 is also the input of pixel 0, \"1\"; give each pixel an input of "
            "its own");
  EXPECT_EQ(error_of(R"("pixels": [{"input": 1}, {"name": "1", "input": 2}])"),
            "/pixels/1/name: \"1\" is also the name of pixel 0; give each pixel a name of its own");
  EXPECT_EQ(error_of(R"("pixels": [{"name": "a/b", "input": 1}])"),
            "/pixels/0/name: \"a/b\" is no pixel's name; it has 1 to 32 letters, digits and . _ + "
            "-");
  EXPECT_EQ(error_of(R"("pixels": [{"input": 4}], "channels": {"sync": 4})"),
            "/pixels/0/input: 4 is also /channels/sync; a tag can have one meaning only");
  EXPECT_EQ(error_of(R"("pixels": [{"name": "a"}])"),
            "/pixels/0/input: is missing and has no default; add it");
  EXPECT_EQ(error_of(R"("pixels": [{"input": 1, "azimut_deg": 1}])"),
            "/pixels/0/azimut_deg: is an unknown key; did you mean azimuth_deg?");
  EXPECT_EQ(error_of(R"("pixels": [])"),
            "/pixels: [] has no pixel; name at least one, or leave it out");
  EXPECT_EQ(error_of(R"("pixels": {"input": 1})"),
            "/pixels: {\"input\":1} is no list; write [ { ... }, ... ]");
  EXPECT_EQ(error_of(R"("pixels": [{"input": 4000}])"),
            "/pixels/0/input: 4000 is above 1024, the most allowed");
}

TEST_F(PixelListTest, HasAsManyPixelsAsTheInstrumentHasInputs) {
  EXPECT_EQ(error_of(list_of(1000)), "");
  EXPECT_EQ(error_of(list_of(10'000)), "/pixels: has 10000 pixels; 1024 are the most");
  EXPECT_EQ(error_of(list_of(1000), R"({"driver": "replay", "recording": "r.ptu"})"),
            "/pixels: has 1000 pixels, and an instrument of driver replay has 64 inputs");
  EXPECT_EQ(error_of(R"("pixels": [{"input": 4}, {"input": 5}])", R"({"driver": "tdc2"})"),
            "/pixels/1/input: 5 is no input, and an instrument of driver tdc2 has inputs 1 to 4");
}

TEST_F(PixelListTest, SaysWhatIsWrongInAFile) {
  const auto error_in = [&](const std::string& text) {
    const std::string file = folder_.write("field", text);
    const std::string error = error_of(R"("pixels": "field")");
    return error.starts_with(file + ": ") ? error.substr(file.size() + 2) : error;
  };
  EXPECT_EQ(error_in("name,input\na,1\nb,two\n"),
            "line 3/input: \"two\" is no whole number of at most 63 bits");
  for (const std::string column :
       {"azimuth_deg", "elevation_deg", "delay_ps", "dead_time_ns", "sigma_ps"}) {
    for (const std::string value : {"nan", "inf", "-inf", "1e999"}) {
      EXPECT_EQ(error_in("input," + column + "\n1," + value + "\n"),
                "line 2/" + column + ": \"" + value + "\" is no number");
    }
  }
  EXPECT_EQ(error_in("input\nnan\n"),
            "line 2/input: \"nan\" is no whole number of at most 63 bits");
  EXPECT_EQ(error_in("name,input\na,1,2\n"),
            "line 2: has 3 cells, and the first line 2 names of columns");
  EXPECT_THAT(error_in("input,colour\n1,red\n"), HasSubstr("line 2/colour: is an unknown key"));
  EXPECT_THAT(error_in("input\n"), HasSubstr("has no pixel; a list is JSON"));
  EXPECT_THAT(error_in("[{\"input\": 0.5}]"), HasSubstr("/0/input: 0.5 is no whole number"));
  EXPECT_THAT(error_in("input\n1\n1\n"),
              HasSubstr("/pixels/1/input: 1 is also the input of pixel 0, \"1\"; give each pixel "
                        "an input of its own (the list of "));
  std::string many = "input\n";
  for (int i = 0; i < 10'000; ++i) many += std::to_string(i) + "\n";
  EXPECT_EQ(error_in(many), "line 1026: is one pixel more than the 1024 that are the most");
}

}  // namespace
}  // namespace splid
