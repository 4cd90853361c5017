#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/usb/usb_source.hpp"

namespace splid::usb {

// An S-Fifteen TDC2 time tagger. JSON: `source` with the driver "tdc2".
struct Tdc2Options : SourceOptions {
  std::vector<double> thresholds_mv = {-448, -448, -448, -448};  // of inputs 1 to 4; NIM
  // The bits of the instrument's status word that mean lost tags when they become 1.
  std::int64_t loss_bits = 0xFFFFFFFF;
  Options usb;

  void describe(OptionVisitor& visitor) override;
  [[nodiscard]] std::optional<OptionFault> validate() const override;
  [[nodiscard]] std::optional<InputRange> inputs() const override { return InputRange{1, 4, 4}; }
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
};

}  // namespace splid::usb
