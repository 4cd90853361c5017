#pragma once

#include <functional>
#include <memory>

#include "config/config.hpp"
#include "drivers/encoder/encoder_source.hpp"
#include "drivers/source.hpp"

namespace splid {

// Hears what a driver reports of its instrument, on the source's thread.
using HearReport = std::function<void(const DeviceReport&)>;

// Opens the configured source of tags. Its warnings and reports go to the log; its reports also to
// `hear`, where there is one, for as long as the source lives.
// Errors: Error as the driver's open() throws it.
std::unique_ptr<TagSource> open_source(const Config& config, HearReport hear = nullptr);

// Opens the configured source of an encoder's counts; null where the configuration has none. Its
// warnings go to the log. source: of the tags, whose scene may have the encoder; may be null.
// Errors: Error as the driver's open_encoder() throws it.
std::unique_ptr<EncoderSource> open_encoder(const EncoderOptions& encoder,
                                            const SourceOptions* source);

}  // namespace splid
