#include "daemon/recording/recording_facts.hpp"

#include <fmt/core.h>

#include <optional>
#include <vector>

#include "config/channel_name.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "drivers/replay/recording_info.hpp"
#include "protocol/error.hpp"
#include "protocol/pattern_json.hpp"
#include "protocol/pattern_match.hpp"

namespace splid::recording {
namespace {

constexpr double least_share = 0.7;

// The configured inputs have their channels before any other that has tags.
PtuInputs inputs_of(const ChannelOptions& channels) {
  std::vector<std::string> names = channels.photon_names();
  names.insert(names.end(), {channels.sync, channels.encoder});
  PtuInputs inputs;
  for (const std::string& name : names) {
    const std::optional<ChannelName> channel = parse_channel(name);
    if (!channel || channel->kind != TagKind::photon) continue;
    if (inputs.channel_of(channel->value)) continue;
    std::string what = channels.pixels.empty() ? "/channels" : "/pixels";
    what.append(": input ").append(name).append(" is one more than the ");
    what.append(std::to_string(PtuInputs::channels));
    what.append(" that a recording can hold; name fewer, or do not record");
    throw Error(Fault::usage, what);
  }
  return inputs;
}

}  // namespace

PtuFacts header_facts(const Config& config, const SourceInfo& source,
                      const std::string& encoder_file) {
  PtuFacts facts;
  facts.instrument = source.name;
  facts.release = SPLID_VERSION;
  facts.pattern_json = to_json(config.pattern);
  facts.config_json = config_to_json(config);
  facts.inputs = inputs_of(config.channels);
  facts.scan = scan_lines(config.frame.by, config.scan, source.scan);
  facts.encoder_file = encoder_file.substr(encoder_file.rfind('/') + 1);
  return facts;
}

void check_inputs(const Config& config) { (void)inputs_of(config.channels); }

TableFacts table_facts(const Config& config, const std::string& recording) {
  return {std::string("splid ") + SPLID_VERSION, config_to_json(config), to_json(config.pattern),
          recording};
}

std::string other_pattern_than_recorded(const Config& config, const RecordingHeader& header,
                                        const std::string& file) {
  if (header.pattern_json.empty()) return {};
  try {
    const Pattern recorded = pattern_from_json(header.pattern_json, file);
    const double share = share_of_same_pulses(recorded, config.pattern);
    if (share >= least_share) return {};
    return file + ": was recorded with another pattern (" + describe_pattern(recorded) +
           ") than /pattern/file " + config.pattern_file + " (" + describe_pattern(config.pattern) +
           fmt::format(
               "); {:.0f} % of the pulses agree. Name the pattern that was played: distances "
               "found with another pattern are wrong",
               100 * share);
  } catch (const Error& error) {
    return file + ": its header's pattern cannot be read (" + error.what() +
           "), so it was not compared with /pattern/file " + config.pattern_file;
  }
}

void warn_of_other_pattern(const Config& config, const std::string& file) {
  const std::string sentence =
      other_pattern_than_recorded(config, scan_recording(file, 1).header, file);
  if (!sentence.empty()) log_warning(sentence);
}

void check_width(const Config& config, const RecordingHeader& header) {
  if (config.pulse.shape != Shape::gaussian) return;
  const auto fault = width_fault(header, config.pulse.sigma_ps);
  if (fault) throw Error(Fault::usage, config.file + ": /pulse/sigma_ps: " + *fault);
}

}  // namespace splid::recording
