#pragma once

#include <functional>
#include <memory>

#include "config/config.hpp"
#include "drivers/encoder/encoder_source.hpp"
#include "drivers/source.hpp"

namespace splid {

// Called on the source's thread with what a driver reports of its instrument.
using HearReport = std::function<void(const DeviceReport&)>;

// Opens the configured source of tags. The source's warnings and reports go to the log. `hear`, if
// there is one, gets the reports too, for as long as the source lives.
// Errors: those of the driver's open().
std::unique_ptr<TagSource> open_source(const Config& config, HearReport hear = nullptr);

// Opens the configured source of an encoder's counts; null where no encoder is configured. The
// source's warnings go to the log. source: the options of the source of tags, whose simulated scene
// may have the encoder; may be null. Errors: those of the driver's open_encoder().
std::unique_ptr<EncoderSource> open_encoder(const EncoderOptions& encoder,
                                            const SourceOptions* source);

}  // namespace splid
