#include "daemon/recording/recording_facts.hpp"

#include "protocol/pattern_json.hpp"

namespace splid {

PtuFacts recording_facts(const Config& config, const SourceInfo& source,
                         const std::string& encoder_file) {
  PtuFacts facts;
  facts.instrument = source.name;
  facts.release = SPLID_VERSION;
  facts.pattern_json = to_json(config.pattern);
  facts.config_json = config_to_json(config);
  facts.encoder_file = encoder_file.substr(encoder_file.rfind('/') + 1);
  return facts;
}

}  // namespace splid
