#pragma once

#include <optional>
#include <string>

#include "protocol/options.hpp"

namespace splid {

// An encoder on the target, whose position frames are compared with. JSON: `encoder`. Its counts
// come from a file or a bridge. Where neither is named, a simulated scene that has a sample clock
// makes the counts itself.
struct EncoderOptions {
  std::string file;           // lines as EncoderBatch has them; empty: none
  std::string address;        // of a bridge that sends such lines; empty: none
  double m_per_count = 1e-4;  // not 0; negative where the counts fall as the target goes away
  double offset_m = 0;        // distance at count 0

  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

}  // namespace splid
