#include "config/option_writer.hpp"

#include <gtest/gtest.h>

#include "config/option_reader.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/every_option.hpp"

namespace splid {
namespace {

using test::EveryOption;

std::string written(EveryOption options) {
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  OptionWriter writer(object);
  options.describe(writer);
  return json_text(object);
}

EveryOption read_back(const std::string& text) {
  const auto json = json_value(text);
  OptionReader reader(json, "a.json", "");
  EveryOption options;
  options.describe(reader);
  reader.finish();
  return options;
}

EveryOption all_given() {
  EveryOption options;
  options.length_ms = 0.1 + 0.7;  // no short decimal
  options.start_s = 1.0 / 3;
  options.count = -3;
  options.live = false;
  options.name = "";
  options.recording = "/data/\"a\".ptu";
  options.colour = EveryOption::Colour::green;
  options.times_s = {1e-9, 8};
  options.table = {{0.1, -3}, {9, 0}};
  options.sync = "";
  options.photon = {"0", "marker:7"};
  options.target.distance_m = 99.5;
  options.targets = {{1}, {2.25}};
  return options;
}

TEST(OptionWriter, WritesDefaultsInTheOrderOfTheirDescriptions) {
  EXPECT_EQ(
      written({}),
      R"({"length_ms":50,"count":4,"live":true,"name":"default","colour":"red",)"
      R"("times_s":[1,2.5],"table":[[1,-2]],"sync":"sync","photon":[1],"target":{"distance_m":1},)"
      R"("targets":[]})");
}

TEST(OptionWriter, WhatItWritesReadsBackTheSame) {
  EXPECT_EQ(read_back(written(all_given())), all_given());
  EXPECT_EQ(read_back(written({})), EveryOption{});
}

}  // namespace
}  // namespace splid
