#pragma once

#include <string>

#include "protocol/pattern.hpp"

namespace splid {

// Pattern files. JSON, schema "splid.pattern", version [1,0]:
//   mode                 baseline, ambiguous, mrr, random or interleaved
//   unambiguous_delay_ps number
//   subperiods_ps        numbers; left out where there are none
//   segments             [{period_ps, pulse_times_ps, amplitudes, repeats}]; amplitudes may be left
//                        out: all 1; repeats may be left out: 0, for ever
//   calibrated_period_ps number; only in a calibrated pattern
//   pulse                {"shape":"tabulated","first_ps":n,"step_ps":n,"density":[n,...]}; only in
//                        a calibrated pattern: see TabulatedPulse
//   calibration          {recording, seconds, photons, signal_photons, std_period_ps,
//                        std_pulse_times_ps, std_amplitudes, std_density, distance_m}; only in a
//                        calibrated pattern, and there it may be left out: see CalibrationFacts
// Numbers print with the fewest digits that read back as the same double, so that a pattern comes
// back from its file bit for bit.

// `file` names the text in errors.
// Errors: Error(Fault::data) with the file, the JSON pointer, the value and the bound; for text
// that is not JSON the line and column; for an unknown member the nearest known one.
Pattern pattern_from_json(const std::string& text, const std::string& file);

// The pattern on one line without a line feed, as in a recording's header.
std::string to_json(const Pattern& pattern);

// The pattern as in a file: each member on a line of its own, arrays of numbers on one line, and a
// line feed at the end.
std::string to_json_file(const Pattern& pattern);

}  // namespace splid
