#include "config/channel_name.hpp"

#include <charconv>
#include <string_view>

namespace splid {
namespace {

constexpr std::string_view marker_prefix = "marker:";
constexpr int max_marker_bits = 15;

std::optional<int> parse_integer(std::string_view text) {
  int value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

}  // namespace

std::optional<ChannelName> parse_channel(const std::string& name) {
  if (name == "sync") return ChannelName{TagKind::sync, 0};
  const bool is_marker = name.starts_with(marker_prefix);
  const std::string_view digits =
      std::string_view(name).substr(is_marker ? marker_prefix.size() : 0);
  const std::optional<int> value = parse_integer(digits);
  if (!value) return std::nullopt;
  const int least = is_marker ? 1 : min_input;
  const int most = is_marker ? max_marker_bits : max_input;
  if (*value < least || *value > most) return std::nullopt;
  return ChannelName{is_marker ? TagKind::marker : TagKind::photon, *value};
}

bool overlap(const ChannelName& a, const ChannelName& b) {
  if (a.kind != b.kind) return false;
  if (a.kind == TagKind::marker) return (a.value & b.value) != 0;
  return a.kind == TagKind::sync || a.value == b.value;
}

}  // namespace splid
