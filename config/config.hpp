#pragma once

#include <functional>
#include <memory>
#include <string>

#include "config/daemon_options.hpp"
#include "config/security_options.hpp"
#include "drivers/awg/awg_options.hpp"
#include "drivers/encoder/encoder_options.hpp"
#include "drivers/source.hpp"
#include "estimator/model/options.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// Everything that a configuration file says, with defaults where it is silent, valid as a whole.
struct Config {
  std::string file;           // as given
  std::string source_driver;  // name of the driver
  std::unique_ptr<SourceOptions> source;
  std::string pattern_file;  // as found: see find_pattern_file()
  std::string pattern_note;  // where it is not where the file says, a sentence for people
  Pattern pattern;           // read from pattern_file and valid
  ChannelOptions channels;
  EncoderOptions encoder;
  PulseOptions pulse;
  FrameOptions frame;
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
  AwgOptions awg;
};

// Errors: Error(Fault::usage) with the file, the JSON pointer, the value and the bound; for text
// that is not JSON the line and column; for an unknown key the nearest known one.
Config load_config(const std::string& file);

// The text of a file that `asked_by`, the beginning of an error's sentence, names.
using ReadText = std::function<std::string(const std::string& file, const std::string& asked_by)>;

// As load_config, from text that stands in `file`, by which relative paths are resolved. read: for
// the pattern file. shipped_patterns: the folder that has it where it is not there; empty: none.
Config config_from_json(const std::string& text, const std::string& file, const ReadText& read,
                        const std::string& shipped_patterns = "");

// The effective configuration, defaults included, as it goes into recordings.
std::string config_to_json(const Config& config);

// JSON Schema (draft 2020-12) of the configuration file, made from the same descriptions that read
// it.
std::string config_schema();

}  // namespace splid
