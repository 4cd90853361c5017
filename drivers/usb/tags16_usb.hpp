#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "drivers/usb/usb_source.hpp"

namespace splid::usb {

// Any device that sends tags16 blocks (docs/reference/tags16.md) over a bulk IN endpoint, such as
// an FPGA that a laboratory programmed itself. JSON: `source` with the driver "tags16-usb".
struct Tags16Options : SourceOptions {
  std::string usb_id;  // vendor and product, "1209:5a1d"
  std::string endpoint = "0x81";
  std::int64_t alternate_setting = 0;  // of interface 0, that has the endpoint
  // Half as many transfers as for other instruments, of twice the length, carry a sixth more tags a
  // second.
  Options usb{.serial = {}, .transfers = 16, .transfer_kib = 512};

  void describe(OptionVisitor& visitor) override;
  [[nodiscard]] std::optional<OptionFault> validate() const override;
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
};

}  // namespace splid::usb
