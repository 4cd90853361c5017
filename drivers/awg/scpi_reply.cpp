#include "drivers/awg/scpi_reply.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "protocol/shown_text.hpp"
#include "protocol/text.hpp"

namespace splid::awg {
namespace {

constexpr std::size_t max_shown = 60;

// Takes the text up to the next comma, and the comma, off the front.
std::string_view take_field(std::string_view& rest) {
  const std::size_t comma = std::min(rest.find(','), rest.size());
  const std::string_view field = trimmed(rest.substr(0, comma));
  rest.remove_prefix(std::min(comma + 1, rest.size()));
  return field;
}

// The number that the whole text is; it may begin with a plus sign.
template <class Number>
std::optional<Number> parse_whole(std::string_view text) {
  if (text.starts_with('+') && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
  Number number{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return number;
}

}  // namespace

std::optional<ScpiIdentity> parse_scpi_identity(std::string_view line) {
  if (std::count(line.begin(), line.end(), ',') != 3) return std::nullopt;
  std::array<std::string, 4> fields;
  for (std::string& field : fields) field = take_field(line);
  if (fields[0].empty() || fields[1].empty()) return std::nullopt;
  return ScpiIdentity{fields[0], fields[1], fields[2], fields[3]};
}

std::optional<ScpiError> parse_scpi_error(std::string_view line) {
  if (line.find(',') == std::string_view::npos) return std::nullopt;
  const auto code = parse_whole<int>(take_field(line));
  std::string_view text = trimmed(line);
  if (!code || text.empty()) return std::nullopt;
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') {
    text = text.substr(1, text.size() - 2);
  }
  return ScpiError{*code, std::string(text)};
}

std::optional<double> parse_scpi_number(std::string_view line) {
  const auto number = parse_whole<double>(trimmed(line));
  return number && std::isfinite(*number) ? number : std::nullopt;
}

std::optional<std::vector<std::int64_t>> parse_scpi_integers(std::string_view line) {
  std::vector<std::int64_t> numbers;
  std::string_view rest = trimmed(line);
  if (rest.ends_with(',')) return std::nullopt;
  do {
    const auto number = parse_whole<std::int64_t>(take_field(rest));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  } while (!rest.empty());
  return numbers;
}

std::optional<ScpiBlockHead> parse_scpi_block_head(std::string_view text) {
  if (text.size() < 2 || text[0] != '#' || text[1] < '1' || text[1] > '9') return std::nullopt;
  const auto digits = static_cast<std::size_t>(text[1] - '0');
  if (text.size() < 2 + digits) return std::nullopt;
  const auto content_bytes = parse_whole<std::uint32_t>(text.substr(2, digits));
  if (!content_bytes || text[2] == '+') return std::nullopt;
  return ScpiBlockHead{2 + digits, *content_bytes};
}

std::string scpi_block_head(std::size_t content_bytes) {
  const std::string digits = std::to_string(content_bytes);
  return "#" + std::to_string(digits.size()) + digits;
}

std::string shown_scpi(std::string_view text) { return shown_text(trimmed(text), max_shown); }

}  // namespace splid::awg
