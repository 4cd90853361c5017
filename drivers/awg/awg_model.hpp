#pragma once

#include <cstdint>
#include <span>

namespace splid::awg {

// How a sample stands in a waveform block.
enum class SampleFormat {
  byte_pair,  // a signed byte, then a byte whose bit 0 is the marker
  word_14,    // 16 bits, little endian: 14 of sample, one unused, bit 0 the marker
};

// A command, and a query that checks it: the answer must end in the command's last number. The
// query is null where no check is made.
//
// These words in braces are filled in: {rate}, {reference}, {amplitude}, {offset}, {marker},
// {half_marker}, {samples}.
struct Step {
  const char* command;
  const char* check = nullptr;
};

// What a waveform generator can play, and the commands that it takes.
struct Model {
  const char* name;      // in the configuration
  const char* identity;  // the model in its answer to *IDN?
  double min_rate_hz;
  double max_rate_hz;
  std::int64_t granule_samples;  // a waveform is a whole number of these
  std::int64_t min_samples;
  std::int64_t max_samples;
  std::int64_t marker_gap_samples;  // between two markers, which would otherwise run together
  double min_amplitude_v;           // from level to level
  double max_amplitude_v;
  double min_marker_v;
  double max_marker_v;
  SampleFormat format;
  // The commands, in the order in which they are sent; the waveform is sent before `play`.
  std::span<const Step> stop;     // after these nothing is played
  std::span<const Step> undo;     // sent after `mode`: nothing is played, every output is off
  std::span<const Step> mode;     // the kind of waveform, and the memory that it is played from
  std::span<const Step> prepare;  // clock, levels, room for the waveform
  std::span<const Step> play;
};

// All models, in the order of their names in the configuration's schema.
std::span<const Model> models();

}  // namespace splid::awg
