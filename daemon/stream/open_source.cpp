#include "daemon/stream/open_source.hpp"

#include <string>
#include <utility>

#include "daemon/base/log.hpp"

namespace splid {
namespace {

void warn(const std::string& sentence) { log_warning(sentence); }

}  // namespace

std::unique_ptr<TagSource> open_source(const Config& config, HearReport hear) {
  SourceContext context;
  context.pattern = &config.pattern;
  context.pixels = config.pixels;
  context.warn = warn;
  context.report = [hear = std::move(hear),
                    cautioned = std::string()](const DeviceReport& report) mutable {
    // With the state `connected` too the reason tells of what went wrong: tags that were lost, say.
    if (!report.reason.empty()) log_warning("{}: {}", to_string(report.state), report.reason);
    if (!report.caution.empty() && report.caution != cautioned) warn(report.caution);
    cautioned = report.caution;
    if (hear) hear(report);
  };
  return config.source->open(context);
}

std::unique_ptr<EncoderSource> open_encoder(const EncoderOptions& encoder,
                                            const SourceOptions* source) {
  return open_encoder(encoder, source, warn);
}

}  // namespace splid
