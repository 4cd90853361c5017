#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "protocol/options.hpp"

namespace splid {

enum class ReferenceClock { internal, external_10_mhz };

// The waveform generator that triggers the laser. JSON: `awg`. The defaults are the trigger pulses
// of [P]'s set-up: -800 mV, 2 ns wide, 9 ns apart at least.
struct AwgOptions {
  std::size_t model = 0;        // into awg_models()
  std::string address;          // HOST or HOST:PORT; empty: there is none
  double pulse_width_ns = 2;    // rounded to whole samples
  double min_spacing_ns = 9;    // from pulse to pulse, that the laser stands
  double pulse_v = -0.8;        // level of a pulse
  double rest_v = 0;            // level between pulses
  double marker_width_ns = 10;  // of the pulse at each pattern's start, for the tagger's sync
  double marker_v = 0.8;        // level of that pulse, from 0 V
  ReferenceClock reference = ReferenceClock::internal;
  bool read_back = true;  // compare what the generator holds with what was sent
  double timeout_s = 10;  // without an answer

  void describe(OptionVisitor& visitor);
  // Levels against what the model can give, the address's form.
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// "tcp:HOST:PORT" for ClientSocket; the port of SCPI over raw sockets, 5025, where none is given.
std::string awg_socket_address(const std::string& address);

}  // namespace splid
