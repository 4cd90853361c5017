#include "protocol/shown_text.hpp"

#include <algorithm>
#include <cstdint>

namespace splid {
namespace {

bool is_shown(std::uint32_t character) {
  if (character < 0x20 || (character >= 0x7F && character < 0xA0)) return false;
  // Marks of direction, separators of lines and paragraphs, embeddings, isolates, a byte order
  // mark.
  if (character == 0x61C || character == 0xFEFF) return false;
  if (character >= 0x200E && character <= 0x200F) return false;
  if (character >= 0x2028 && character <= 0x202E) return false;
  return character < 0x2066 || character > 0x2069;
}

// The bytes of the character that the text begins with; 0 where these are no UTF-8, or are not to
// be shown.
std::size_t shown_bytes(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::uint32_t first = byte(0);
  const std::size_t bytes = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (bytes == 1) return is_shown(first) ? 1 : 0;
  if (first < 0xC2 || first > 0xF4 || text.size() < bytes) return 0;
  std::uint32_t character = first & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return 0;
    character = (character << 6U) | (byte(i) & 0x3FU);
  }
  constexpr std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = character >= 0xD800 && character <= 0xDFFF;
  if (character < least[bytes] || character > 0x10FFFF || is_surrogate) return 0;
  return is_shown(character) ? bytes : 0;
}

}  // namespace

std::string shown_text(std::string_view text, std::size_t most) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t bytes = shown_bytes(text);
    if (shown.size() + std::max<std::size_t>(bytes, 1) > most) return shown + "...";
    shown += bytes == 0 ? std::string_view("?") : text.substr(0, bytes);
    text.remove_prefix(std::max<std::size_t>(bytes, 1));
  }
  return shown;
}

std::string shown_lines(std::string_view text) {
  std::string shown;
  for (;;) {
    const std::size_t end = text.find('\n');
    shown += shown_text(text.substr(0, end), std::string::npos);
    if (end == std::string_view::npos) return shown;
    shown += '\n';
    text.remove_prefix(end + 1);
  }
}

}  // namespace splid
