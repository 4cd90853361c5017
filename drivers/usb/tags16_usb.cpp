#include "drivers/usb/tags16_usb.hpp"

#include <charconv>
#include <chrono>
#include <utility>

#include "drivers/tags16_stream.hpp"
#include "protocol/tags16.hpp"

namespace splid {
namespace {

// 0x81 to 0x8f: IN, with a number.
std::optional<std::uint8_t> parse_endpoint(const std::string& text) {
  if (text.size() != 4 || text.compare(0, 2, "0x") != 0) return std::nullopt;
  std::uint8_t value = 0;
  const char* const last = text.data() + text.size();
  const auto result = std::from_chars(text.data() + 2, last, value, 16);
  const bool whole = result.ec == std::errc{} && result.ptr == last;
  if (!whole || value < 0x81 || value > 0x8F) return std::nullopt;
  return value;
}

class Tags16Instrument final : public UsbInstrument {
 public:
  Tags16Instrument(std::uint8_t endpoint, int setting) : endpoint_(endpoint), setting_(setting) {}

  [[nodiscard]] std::uint8_t data_endpoint() const override { return endpoint_; }
  [[nodiscard]] int alternate_setting() const override { return setting_; }
  [[nodiscard]] bool owes_data() const override { return true; }

  void decode(std::span<const std::byte> bytes, TagSink& sink) override {
    for (;;) {
      const std::span<Tag> room = sink.claim(most_tags);
      if (room.empty()) return;
      const auto done = decoder_.decode(bytes, room);
      sink.publish(done.tags);
      bytes = bytes.subspan(done.bytes);
      // More tags may wait for room.
      if (bytes.empty() && done.tags < room.size()) return;
    }
  }

  std::string tend(UsbDevice&, TagSink&) override {
    return news_.since_last(decoder_.counts(), std::chrono::steady_clock::now());
  }

  // The decoder says it with the next block.
  void cut(TagSink&) override { decoder_.cut(); }

  void end(TagSink& sink) override {
    if (decoder_.counts().blocks > 0) put_clock_end(decoder_.reached_ps(), sink);
  }

 private:
  static constexpr std::size_t most_tags = 16'384;

  std::uint8_t endpoint_;
  int setting_;
  Tags16Decoder decoder_;
  Tags16News news_;
};

const bool tags16_usb_registered =
    register_source("tags16-usb", std::make_unique<Tags16UsbOptions>);

}  // namespace

void Tags16UsbOptions::describe(OptionVisitor& visitor) {
  visitor.text("usb_id", usb_id,
               "vendor and product of the device, four hexadecimal digits each, such as 1209:0001");
  visitor.require("usb_id");
  visitor.text("endpoint", endpoint, "bulk IN endpoint that the blocks come from, 0x81 to 0x8f");
  visitor.integer("alternate_setting", alternate_setting, 0, 255,
                  "alternate setting of interface 0 that has the endpoint");
  usb.describe(visitor);
}

std::optional<OptionFault> Tags16UsbOptions::validate() const {
  if (!parse_usb_id(usb_id)) {
    return OptionFault{"/usb_id", "\"" + usb_id +
                                      "\" is no USB id; it is four hexadecimal digits, a colon and "
                                      "four more, such as \"1209:0001\""};
  }
  if (!parse_endpoint(endpoint)) {
    return OptionFault{"/endpoint",
                       "\"" + endpoint + "\" is no IN endpoint; it is \"0x81\" to \"0x8f\""};
  }
  return std::nullopt;
}

std::unique_ptr<TagSource> Tags16UsbOptions::open(const SourceContext& context) const {
  UsbOptions device = usb;
  device.ids = {*parse_usb_id(usb_id)};
  const std::uint8_t address = *parse_endpoint(endpoint);
  const auto setting = static_cast<int>(alternate_setting);
  return std::make_unique<UsbSource>(
      "tags16 device " + usb_id, std::move(device),
      [address, setting] { return std::make_unique<Tags16Instrument>(address, setting); }, context);
}

}  // namespace splid
