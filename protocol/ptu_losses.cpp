#include "protocol/ptu_losses.hpp"

#include <algorithm>
#include <cstddef>

#include "protocol/loss_collector.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

std::string to_text(const std::vector<Loss>& losses) {
  std::string text;
  for (const Loss& loss : losses) {
    if (!text.empty()) text += ' ';
    text += std::to_string(loss.begin_ps) + ':' + std::to_string(loss.end_ps) + ':' +
            std::to_string(loss.count);
  }
  return text;
}

std::optional<Loss> loss_from_text(std::string_view text) {
  const auto begin_ps = whole_number(take_until(text, ':'));
  const auto end_ps = whole_number(take_until(text, ':'));
  const auto count = whole_number(text);
  if (!begin_ps || !end_ps || !count || *end_ps < *begin_ps || *count < -1) return std::nullopt;
  return Loss{*begin_ps, *end_ps, *count};
}

}  // namespace

std::string losses_to_text(std::vector<Loss> losses, std::size_t max_chars) {
  std::string text = to_text(losses);
  while (text.size() > max_chars && losses.size() > 1) {
    // The losses are cut in proportion to the length, by at least one. So a few rounds are enough.
    const std::size_t fitting = losses.size() * max_chars / text.size();
    join_losses(losses, std::clamp<std::size_t>(fitting, 1, losses.size() - 1));
    text = to_text(losses);
  }
  return text;
}

std::optional<std::vector<Loss>> losses_from_text(std::string_view text) {
  std::vector<Loss> losses;
  while (!text.empty()) {
    const auto loss = loss_from_text(take_until(text, ' '));
    if (!loss) return std::nullopt;
    losses.push_back(*loss);
  }
  return losses;
}

}  // namespace splid
