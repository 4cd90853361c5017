#include "protocol/encoder_batch.hpp"

#include "protocol/text.hpp"

namespace splid {
namespace {

constexpr std::string_view overrun_word = "overrun";

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
