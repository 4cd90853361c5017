#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "protocol/options.hpp"

namespace splid::awg {

enum class ReferenceClock { internal, external_10_mhz };

// The waveform generator that triggers the laser. JSON: `awg`. The defaults are the trigger pulses
// of [P]'s set-up: -800 mV, 2 ns wide, 9 ns apart at least.
struct Options {
  std::size_t model = 0;        // into models()
  std::string address;          // HOST or HOST:PORT; empty: there is no generator
  double pulse_width_ns = 2;    // rounded to whole samples
  double min_spacing_ns = 9;    // the least from pulse to pulse that the laser stands
  double pulse_v = -0.8;        // level of a pulse
  double rest_v = 0;            // level between pulses
  double marker_width_ns = 10;  // of the marker at each pattern's start, the tagger's sync
  double marker_v = 0.8;        // level of the marker, which begins at 0 V
  ReferenceClock reference = ReferenceClock::internal;
  bool read_back = true;  // compare what the generator holds with what was sent
  double timeout_s = 10;  // the longest wait for a whole answer

  void describe(OptionVisitor& visitor);
  // Checks the levels against what the model can give, and the form of the address.
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// The address as ClientSocket takes it, "tcp:HOST:PORT". Where no port is given it is 5025, the
// port of SCPI over raw sockets.
std::string socket_address(const std::string& address);

}  // namespace splid::awg
