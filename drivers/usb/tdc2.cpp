#include "drivers/usb/tdc2.hpp"

#include <utility>

#include "drivers/usb/tdc2_instrument.hpp"

namespace splid::usb {
namespace {

// The ids of the instrument as S-Fifteen sells it, and of its maker's kit.
const bool tdc2_registered =
    register_source("tdc2", std::make_unique<Tdc2Options>, {{0x3137, 0x200a}, {0x04b4, 0x123a}});

}  // namespace

void Tdc2Options::describe(OptionVisitor& visitor) {
  visitor.numbers(
      "thresholds_mv", thresholds_mv, {-1024, 2047.25},
      "threshold of each of the four inputs, mV; up to -0.25 mV falling edges count, as "
      "of NIM pulses (-448), above it rising ones, as of TTL (1000)");
  visitor.integer("loss_bits", loss_bits, 0, 0xFFFFFFFF,
                  "bits of the instrument's status word that report lost tags; the maker does not "
                  "publish them, so all count by default");
  usb.describe(visitor);
}

std::optional<OptionFault> Tdc2Options::validate() const {
  if (thresholds_mv.size() == 4) return std::nullopt;
  return OptionFault{"/thresholds_mv", std::to_string(thresholds_mv.size()) +
                                           " numbers; there must be four, one for each input"};
}

std::unique_ptr<TagSource> Tdc2Options::open(const SourceContext& context) const {
  Tdc2Settings settings;
  for (std::size_t i = 0; i < settings.thresholds_mv.size(); ++i) {
    settings.thresholds_mv.at(i) = thresholds_mv.at(i);
  }
  settings.loss_bits = static_cast<std::uint32_t>(loss_bits);
  InstrumentKind kind;
  kind.name = "S-Fifteen TDC2";
  kind.ids = usb_ids_of("tdc2");
  kind.make = [settings] { return std::make_unique<Tdc2Instrument>(settings); };
  return std::make_unique<Source>(std::move(kind), usb, context);
}

}  // namespace splid::usb
