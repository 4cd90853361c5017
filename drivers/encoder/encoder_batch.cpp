#include "drivers/encoder/encoder_batch.hpp"

#include "protocol/ptu_losses.hpp"

namespace splid {
namespace {

constexpr std::string_view overrun_word = "overrun";

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

}  // namespace

std::optional<EncoderBatch> parse_encoder_line(std::string_view line) {
  EncoderBatch batch;
  std::string_view rest = trimmed(line);
  if (rest.empty() || rest.front() == '#') return batch;
  batch.overrun = rest == overrun_word;
  if (batch.overrun) return batch;
  const std::size_t comma = rest.find(',');
  const auto first_index = whole_number(trimmed(rest.substr(0, comma)));
  if (!first_index || *first_index < 0 || comma == std::string_view::npos) return std::nullopt;
  batch.first_index = *first_index;
  for (std::size_t at = comma; at != std::string_view::npos;) {
    rest.remove_prefix(at + 1);
    at = rest.find(',');
    const auto count = whole_number(trimmed(rest.substr(0, at)));
    if (!count) return std::nullopt;
    batch.counts.push_back(*count);
  }
  return batch;
}

std::string to_encoder_line(const EncoderBatch& batch) {
  std::string text;
  if (batch.overrun) text += std::string(overrun_word) + '\n';
  if (batch.counts.empty()) return text;
  text += std::to_string(batch.first_index);
  for (const std::int64_t count : batch.counts) text += ',' + std::to_string(count);
  return text + '\n';
}

}  // namespace splid
