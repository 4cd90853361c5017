#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace splid::forward {

// One message on its way to a broker.
struct Message {
  std::string topic;  // `frame`, `scene`, `status`; of forward itself `gap` and `forward`
  std::string id;     // DEVICE/TOPIC/SEQUENCE/TIMESTAMP: the same for the same message alone
  std::string json;
  std::uint64_t sequence = 0;
  double timestamp_s = 0;
};

// Topics of the messages that forward itself makes.
inline constexpr const char* topic_gap = "gap";
inline constexpr const char* topic_forward = "forward";

// A daemon that starts anew counts from 0 again; the timestamp tells its messages from the earlier
// ones. Absent for JSON without a sequence and a timestamp.
std::optional<Message> make_message(const std::string& device, const std::string& topic,
                                    std::string json);

}  // namespace splid::forward
