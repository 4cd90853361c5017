#include "daemon/forward/message.hpp"

#include <fmt/core.h>

#include <utility>

#include "protocol/json_value.hpp"

namespace splid::forward {

std::optional<Message> make_message(const std::string& device, const std::string& topic,
                                    std::string json) {
  const auto value = json_value_if_any(json);
  if (!value.is_object()) return std::nullopt;
  const auto sequence = value.find("sequence");
  const auto timestamp = value.find("timestamp");
  if (sequence == value.end() || !sequence->is_number_unsigned()) return std::nullopt;
  if (timestamp == value.end() || !timestamp->is_number()) return std::nullopt;
  Message message;
  message.topic = topic;
  message.sequence = sequence->get<std::uint64_t>();
  message.timestamp_s = timestamp->get<double>();
  message.id = fmt::format("{}/{}/{}/{:.6f}", device, topic, message.sequence, message.timestamp_s);
  message.json = std::move(json);
  return message;
}

}  // namespace splid::forward
