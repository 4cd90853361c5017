#pragma once

#include <memory>
#include <optional>

#include "drivers/usb/ttm_decode.hpp"
#include "drivers/usb/usb_source.hpp"

namespace splid::usb {

// A BrightEyes-TTM, an open time tagger for arrays of 25 or 49 SPADs, with firmware 2. JSON:
// `source` with the driver "brighteyes-ttm".
struct TtmOptions : SourceOptions {
  Options usb;

  void describe(OptionVisitor& visitor) override { usb.describe(visitor); }
  [[nodiscard]] std::optional<InputRange> inputs() const override {
    return InputRange{0, TtmDecoder::inputs - 1, TtmDecoder::inputs};
  }
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
};

}  // namespace splid::usb
