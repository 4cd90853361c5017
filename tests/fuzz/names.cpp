#include <array>

#include "config/channel_name.hpp"
#include "config/daemon_options.hpp"
#include "drivers/client_socket.hpp"
#include "drivers/usb/usb_id.hpp"
#include "protocol/nearest_name.hpp"
#include "tests/fuzz/fuzz.hpp"

// Names that people write: channels, USB devices, addresses of sockets, endpoints, and misspelt
// keys. Each is a value, or refused; a value is written as it was read.

namespace splid::test::fuzz_names {
namespace {

void check_channel(const std::string& text) {
  const auto channel = parse_channel(text);
  if (!channel) return;
  must(channel->kind == TagKind::sync || channel->kind == TagKind::marker ||
           channel->kind == TagKind::photon,
       "a channel is one of events");
  must(channel->matches({0, channel->value, channel->kind, {}}), "a channel has its own tags");
  must(overlap(*channel, *channel), "a channel overlaps itself");
}

void check_addresses(const std::string& text) {
  if (const auto fault = socket_address_fault(text)) {
    must(!fault->empty(), "a fault says what is wrong");
  }
  PublishOptions publish;
  publish.endpoint = text;
  if (const auto fault = publish.validate()) {
    must(fault->pointer == "/endpoint" && !fault->what.empty(), "a fault says what is wrong");
  }
}

void check(const std::string& text) {
  check_channel(text);
  check_addresses(text);
  if (const auto id = usb::parse_id(text)) {
    must(usb::parse_id(to_string(*id)) == id, "a USB id comes back");
  }
  constexpr std::array<const char*, 4> keys = {"photon", "sync", "encoder", "endpoint"};
  const char* near = nearest_name(text, keys);
  must(near == nullptr || std::count(keys.begin(), keys.end(), near) == 1, "a near name is known");
  must(!suggest_name(text, keys).empty(), "there is something to suggest");
}

}  // namespace
}  // namespace splid::test::fuzz_names

SPLID_FUZZ_TARGET(names) {
  splid::test::fuzz_names::check(splid::test::as_text(data, size));
  return 0;
}
