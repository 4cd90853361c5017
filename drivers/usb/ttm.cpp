#include "drivers/usb/ttm.hpp"

#include <utility>

#include "drivers/usb/ttm_instrument.hpp"

namespace splid::usb {
namespace {

// The id that Cypress' FX3 has with the streaming firmware that the instrument runs.
const bool ttm_registered =
    register_source("brighteyes-ttm", std::make_unique<TtmOptions>, {{0x04b4, 0x00f1}});

}  // namespace

std::unique_ptr<TagSource> TtmOptions::open(const SourceContext& context) const {
  InstrumentKind kind;
  kind.name = "BrightEyes-TTM";
  kind.ids = usb_ids_of("brighteyes-ttm");
  kind.make = [] { return std::make_unique<TtmInstrument>(); };
  return std::make_unique<Source>(std::move(kind), usb, context);
}

}  // namespace splid::usb
