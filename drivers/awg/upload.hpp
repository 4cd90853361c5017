#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "drivers/awg/awg_options.hpp"
#include "drivers/awg/waveform_plan.hpp"
#include "protocol/pattern.hpp"

// drivers/awg/ has a waveform generator play the pattern. Read this header first: upload() is the
// whole way. Its parts:
//
//   waveform_plan     which rate and how many samples play the pattern, and how far off they are
//   waveform_samples  the samples of a plan, as the generator takes them
//   awg_model         what each model can play, and its commands
//   scpi_client       commands and their answers over a socket; scpi_reply reads the answers

namespace splid::awg {

// Is told what happens, and which part of it is done: 0 to 1.
using UploadProgress = std::function<void(const char* what, double part)>;

struct Uploaded {
  Pattern played;          // what the generator plays at the rate that it says it has
  std::string instrument;  // maker, model, serial and firmware
};

// Plans the pattern's waveform, sends it to the configured generator and has it played. The outputs
// are off until all samples are in the generator and, with read_back, are those that were sent.
// Then the marker, the pulses and play are switched on. Each command is done, and the error queue
// empty, before the next command is sent.
//
// Threads: the caller's; a stop may be requested from any thread. Errors: plan_waveform()'s before
// anything is sent; Error(Fault::usage) where there is no address or a stop was requested;
// Error(Fault::device) naming the generator, the command and its answer. If anything goes wrong
// after the generator was found to be the configured model, play is ended and its outputs are
// switched off, and the error says whether that went well. Timeouts: options.timeout_s for each
// answer, at most 2 s for the answers to the commands that switch off.
Uploaded upload(const Options& options, const Pattern& pattern, const UploadProgress& progress,
                const std::stop_token& stop);

// Ends play and switches the outputs off. Returns the instrument's maker, model, serial and
// firmware. Errors, timeouts: as upload().
std::string switch_off(const Options& options, const std::stop_token& stop);

}  // namespace splid::awg
