// The configurations in config/, which people start from.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "config/bridge_config.hpp"
#include "config/config.hpp"
#include "drivers/bridge/bridge.hpp"
#include "drivers/idq/options.hpp"
#include "drivers/picoquant/options.hpp"
#include "drivers/simulator/array_pixels.hpp"
#include "drivers/simulator/simulator_options.hpp"

namespace splid {
namespace {

const std::string folder = SPLID_SOURCE_DIR "/config/";

std::vector<std::string> shipped() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".json") && name != "config.schema.json") names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST(ShippedConfig, ThereIsOneForEachUse) {
  EXPECT_THAT(shipped(), ::testing::ElementsAre(
                             "ambiguous.json", "array.json", "baseline.json", "brighteyes-ttm.json",
                             "demo.json", "dim.json", "encoder.json", "idq.json",
                             "interleaved.json", "m8190a-mrr.json", "m8195a-swabian.json",
                             "mrr.json", "picoquant.json", "random.json", "replay.json",
                             "swabian-bridge.json", "tags16-usb.json", "tdc2.json"));
}

TEST(ShippedConfig, AllLoad) {
  for (const std::string& name : shipped()) EXPECT_NO_THROW(load_config(folder + name)) << name;
}

TEST(ShippedConfig, ABridgeAndItsReaderMeetAtOnePlace) {
  picoquant::Options picoquant;
  idq::Options idq;
  const auto expect_meet = [](const std::string& maker, SourceOptions& options) {
    const std::string listen =
        load_bridge_config(folder + "bridges/" + maker + "-bridge.json", maker, options);
    const Config config = load_config(folder + maker + ".json");
    EXPECT_EQ(dynamic_cast<const BridgeOptions&>(*config.source).address, listen);
  };
  expect_meet("picoquant", picoquant);
  expect_meet("idq", idq);
}

TEST(ShippedConfig, EachModesOwnHasItsPattern) {
  for (const Mode mode :
       {Mode::baseline, Mode::ambiguous, Mode::mrr, Mode::random, Mode::interleaved}) {
    const Config config = load_config(folder + to_string(mode) + ".json");
    EXPECT_EQ(config.pattern.mode, mode);
    EXPECT_EQ(config.source_driver, "simulator");
  }
}

TEST(ShippedConfig, TheDimSceneHasANinthOfTheDemosSignal) {
  const Config demo = load_config(folder + "demo.json");
  const Config dim = load_config(folder + "dim.json");
  const auto signal = [](const Config& config) {
    return dynamic_cast<const simulator::Options&>(*config.source).detection.signal_per_pulse;
  };
  EXPECT_DOUBLE_EQ(signal(dim), signal(demo) / 9);
}

TEST(ShippedConfig, TheArraysPixelsLookWhereItsDetectorsDo) {
  const Config config = load_config(folder + "array.json");
  const auto detectors =
      simulator::array_pixels(dynamic_cast<const simulator::Options&>(*config.source));
  ASSERT_EQ(config.pixels.size(), detectors.size());
  for (std::size_t i = 0; i < detectors.size(); ++i) {
    EXPECT_EQ(config.pixels[i].input, detectors[i].scene.photon_input);
    EXPECT_EQ(config.pixels[i].azimuth_deg, detectors[i].direction.azimuth_deg);
    EXPECT_EQ(config.pixels[i].elevation_deg, detectors[i].direction.elevation_deg);
    EXPECT_GT(detectors[i].scene.detection.signal_per_pulse, 0);
  }
}

TEST(ShippedConfig, TheReplayNamesARecordingBesideIt) {
  const Config config = load_config(folder + "replay.json");
  EXPECT_EQ(config.source_driver, "replay");
  EXPECT_THAT(config_to_json(config),
              ::testing::HasSubstr("\"recording\":\"" + folder + "recording.ptu\""));
}

}  // namespace
}  // namespace splid
