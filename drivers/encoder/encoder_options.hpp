#pragma once

#include <optional>
#include <string>

#include "protocol/options.hpp"

namespace splid {

// An encoder on the target, to compare with. JSON: `encoder`. Its counts come from a file or a
// bridge; without either, a simulated scene with a sample clock makes its own.
struct EncoderOptions {
  std::string file;           // lines as EncoderBatch has them; empty: none
  std::string address;        // of a bridge that sends such lines; empty: none
  double m_per_count = 1e-4;  // not 0; negative where the counts fall as the target goes away
  double offset_m = 0;        // distance at count 0

  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

}  // namespace splid
