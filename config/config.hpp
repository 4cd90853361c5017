#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/daemon_options.hpp"
#include "config/scan_options.hpp"
#include "config/security_options.hpp"
#include "drivers/awg/awg_options.hpp"
#include "drivers/encoder/encoder_options.hpp"
#include "drivers/source.hpp"
#include "estimator/model/options.hpp"
#include "protocol/pattern.hpp"
#include "protocol/pixel.hpp"

// config/ is the configuration file: the daemon's own options, and the one reader that fills them
// and the options of the drivers and the estimator. A newcomer should read this header first. Where
// to look for
//   a key        describe() beside the structure of its options: config/daemon_options.cpp,
//                config/security_options.cpp, a driver's options, estimator/model/options.cpp
//   key checks   the bounds of a single key: config/option_reader.cpp; keys that must fit each
//                other: validate() beside describe(); sections that must fit each other: config.cpp

namespace splid {

// Everything that a configuration file says, with defaults where it is silent, valid as a whole.
struct Config {
  std::string file;                // as given
  std::vector<std::string> notes;  // a sentence for people on each value that is not as it says
  std::string source_driver;       // name of the driver
  std::shared_ptr<SourceOptions> source;  // copies share it
  std::string pattern_file;               // where it was found: see find_pattern_file()
  Pattern pattern;                        // read from pattern_file and valid
  ChannelOptions channels;
  std::vector<PixelOptions> pixels;  // empty: one, of channels.photon
  std::string pixels_file;           // that they were read from; empty: the configuration
  EncoderOptions encoder;
  PulseOptions pulse;
  FrameOptions frame;
  ScanOptions scan;
  DriftOptions drift;
  SceneOptions scene;
  EstimatorOptions estimator;
  DetectorOptions detector;
  PipelineOptions pipeline;
  PublishOptions publish;
  SecurityOptions security;
  ControlOptions control;
  MetricsOptions metrics;
  RecordOptions record;
  awg::Options awg;
};

// Errors: Error(Fault::usage) with the file, the JSON pointer, the value and the bound; for text
// that is not JSON the line and column; for an unknown key the nearest known one.
Config load_config(const std::string& file);

// Reads a file and returns its text. asked_by: the beginning of an error's sentence, which names
// the key that asked for the file.
using ReadText = std::function<std::string(const std::string& file, const std::string& asked_by)>;

// Does what load_config() does with `text`, the content of `file`; relative paths are relative to
// that file. read: reads the pattern file and a file of pixels. shipped_patterns: the folder to
// look for the pattern in where it is not where the configuration says; empty: none.
Config config_from_json(const std::string& text, const std::string& file, const ReadText& read,
                        const std::string& shipped_patterns = "");

// The effective configuration as JSON, defaults included. Recordings hold it in this form.
std::string config_to_json(const Config& config);

// JSON Schema (draft 2020-12) of the configuration file, made from the same descriptions that read
// it.
std::string config_schema();

}  // namespace splid
