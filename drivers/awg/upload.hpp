#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "drivers/awg/awg_options.hpp"
#include "drivers/awg/waveform_plan.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// What happens, and how far it is: 0 to 1.
using UploadProgress = std::function<void(const char* what, double part)>;

struct Uploaded {
  Pattern played;          // what the generator plays, by the rate that it says it has
  std::string instrument;  // maker, model, serial and firmware
};

// Plans the pattern's waveform, sends it to the configured generator and has it played. Outputs are
// off until all samples are there and, with read_back, compare; then marker, pulses and play go on.
// Every command is done and the error queue empty before the next.
//
// Threads: the caller's; a stop may be requested from any. Errors: plan_waveform()'s before
// anything is sent; Error(Fault::usage) where there is no address or a stop was requested;
// Error(Fault::device) naming the generator, the command and its answer. Whatever goes wrong once
// the generator is known to be the configured one, play is ended and its outputs are switched off,
// and the error says whether that went well. Timeouts: options.timeout_s for each answer, 2 s at
// most for those of the commands that switch off.
Uploaded upload(const AwgOptions& options, const Pattern& pattern, const UploadProgress& progress,
                const std::stop_token& stop);

// Ends play and switches the output off. Returns the instrument. Errors, Timeouts: as upload().
std::string stop_awg(const AwgOptions& options, const std::stop_token& stop);

}  // namespace splid
