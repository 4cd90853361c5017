#include "drivers/usb/tags16_usb.hpp"

#include <charconv>
#include <chrono>
#include <utility>

#include "drivers/tag_writer.hpp"
#include "drivers/tags16_stream.hpp"

namespace splid::usb {
namespace {

// The address of an IN endpoint is 0x81 to 0x8f.
std::optional<std::uint8_t> parse_endpoint(const std::string& text) {
  if (text.size() != 4 || text.compare(0, 2, "0x") != 0) return std::nullopt;
  std::uint8_t value = 0;
  const char* const last = text.data() + text.size();
  const auto result = std::from_chars(text.data() + 2, last, value, 16);
  const bool whole = result.ec == std::errc{} && result.ptr == last;
  if (!whole || value < 0x81 || value > 0x8F) return std::nullopt;
  return value;
}

class Tags16Instrument final : public Instrument {
 public:
  Tags16Instrument(std::uint8_t endpoint, int setting, Tags16Counters& counters)
      : endpoint_(endpoint), setting_(setting), stream_(counters) {}

  [[nodiscard]] std::uint8_t data_endpoint() const override { return endpoint_; }
  [[nodiscard]] int alternate_setting() const override { return setting_; }
  [[nodiscard]] bool owes_data() const override { return true; }

  void decode(std::span<const std::byte> bytes, TagSink& sink) override {
    stream_.feed(bytes, sink);
  }

  std::string tend(Device&, TagSink&) override {
    return news_.since_last(stream_.counts(), std::chrono::steady_clock::now());
  }

  // The next block tells of the loss.
  void cut(TagSink&) override { stream_.cut(); }

  void end(TagSink& sink) override {
    if (stream_.counts().blocks > 0) put_clock_end(stream_.reached_ps(), sink);
  }

 private:
  std::uint8_t endpoint_;
  int setting_;
  Tags16Stream stream_;
  Tags16News news_;
};

const bool tags16_usb_registered = register_source("tags16-usb", std::make_unique<Tags16Options>);

}  // namespace

void Tags16Options::describe(OptionVisitor& visitor) {
  visitor.text("usb_id", usb_id,
               "vendor and product of the device, four hexadecimal digits each, such as 1209:0001");
  visitor.require("usb_id");
  visitor.text("endpoint", endpoint, "bulk IN endpoint that the blocks come from, 0x81 to 0x8f");
  visitor.integer("alternate_setting", alternate_setting, 0, 255,
                  "alternate setting of interface 0 that has the endpoint");
  usb.describe(visitor);
}

std::optional<OptionFault> Tags16Options::validate() const {
  if (!parse_id(usb_id)) {
    return OptionFault{"/usb_id", "\"" + usb_id +
                                      "\" is not a USB id; write four hexadecimal digits, a colon "
                                      "and four digits, such as \"1209:0001\""};
  }
  if (!parse_endpoint(endpoint)) {
    return OptionFault{"/endpoint",
                       "\"" + endpoint + "\" is no IN endpoint; it is \"0x81\" to \"0x8f\""};
  }
  return std::nullopt;
}

std::unique_ptr<TagSource> Tags16Options::open(const SourceContext& context) const {
  const auto counters = std::make_shared<Tags16Counters>();
  InstrumentKind kind;
  kind.name = "tags16 device " + usb_id;
  kind.ids = {*parse_id(usb_id)};
  kind.make = [address = *parse_endpoint(endpoint), setting = static_cast<int>(alternate_setting),
               counters] {
    return std::make_unique<Tags16Instrument>(address, setting, *counters);
  };
  kind.counters = [counters] { return counters->list(); };
  return std::make_unique<Source>(std::move(kind), usb, context);
}

}  // namespace splid::usb
