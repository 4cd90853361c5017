#pragma once

#include <cstdint>
#include <span>

namespace splid {

// How a sample stands in a waveform block.
enum class SampleFormat {
  byte_pair,  // a signed byte, then a byte whose bit 0 is the marker
  word_14,    // 16 bits, little endian: 14 of sample, one unused, bit 0 the marker
};

// A command, and the query whose answer must end in the command's last number; null: none has.
//
// Words in braces are filled in: {rate}, {reference}, {amplitude}, {offset}, {marker},
// {half_marker}, {samples}.
struct AwgStep {
  const char* command;
  const char* check = nullptr;
};

// What a waveform generator can play, and the words it wants to hear.
struct AwgModel {
  const char* name;      // in the configuration
  const char* identity;  // the model in its answer to *IDN?
  double min_rate_hz;
  double max_rate_hz;
  std::int64_t granule_samples;  // a waveform is a whole number of these
  std::int64_t min_samples;
  std::int64_t max_samples;
  std::int64_t marker_gap_samples;  // between markers, so that they do not become one
  double min_amplitude_v;           // from level to level
  double max_amplitude_v;
  double min_marker_v;
  double max_marker_v;
  SampleFormat format;
  // In their order; the waveform comes before `play`.
  std::span<const AwgStep> stop;     // nothing is played
  std::span<const AwgStep> undo;     // after `mode`: nothing is played, and every output is off
  std::span<const AwgStep> mode;     // which of its kinds of waveform, from which memory
  std::span<const AwgStep> prepare;  // clock, levels, room for the waveform
  std::span<const AwgStep> play;
};

// In the order of the configuration's names.
std::span<const AwgModel> awg_models();

}  // namespace splid
