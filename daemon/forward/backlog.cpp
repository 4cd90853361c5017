#include "daemon/forward/backlog.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "protocol/json_value.hpp"

namespace splid::forward {

Backlog::Backlog(std::string device, std::size_t most_bytes)
    : device_(std::move(device)), most_bytes_(most_bytes) {}

// The structure and the id count too: a flood of tiny messages takes no more than is allowed.
std::size_t Backlog::size_of(const Message& message) {
  return message.json.size() + message.id.size() + sizeof(Message);
}

void Backlog::add(Message message) {
  const std::lock_guard lock(mutex_);
  ++counts_.added;
  ++counts_.waiting;
  counts_.bytes += size_of(message);
  queue_.push_back(std::move(message));
  while (counts_.bytes > most_bytes_ && !queue_.empty()) {
    drop(queue_.front());
    queue_.pop_front();
  }
  came_.notify_one();
}

void Backlog::drop(const Message& message) {
  ++counts_.lost;
  --counts_.waiting;
  counts_.bytes -= size_of(message);
  Lost& lost = gap_[message.topic];
  const bool is_first = lost.count++ == 0;
  // By their times: a message that was on its way may be refused after newer ones were dropped, and
  // the sequence of a daemon that starts again begins at 0.
  if (is_first || message.timestamp_s < lost.first_s) {
    lost.first_s = message.timestamp_s;
    lost.first_sequence = message.sequence;
  }
  if (is_first || message.timestamp_s >= lost.last_s) {
    lost.last_s = message.timestamp_s;
    lost.last_sequence = message.sequence;
  }
}

Message Backlog::make_gap() {
  double end_s = gap_.begin()->second.last_s;
  for (const auto& [topic, lost] : gap_) end_s = std::max(end_s, lost.last_s);
  nlohmann::ordered_json gap = {{"schema", "splid.gap"}, {"v", {1, 0}},
                                {"timestamp", end_s},    {"sequence", gaps_},
                                {"device", device_},     {"lost", nlohmann::ordered_json::array()}};
  for (const auto& [topic, lost] : gap_) {
    gap["lost"].push_back({{"topic", topic},
                           {"count", lost.count},
                           {"first_sequence", lost.first_sequence},
                           {"last_sequence", lost.last_sequence}});
  }
  gap_.clear();
  Message message;
  message.topic = topic_gap;
  message.id = fmt::format("{}/{}/{}/{:.6f}", device_, topic_gap, gaps_, end_s);
  message.json = json_text(gap);
  message.sequence = gaps_++;
  message.timestamp_s = end_s;
  ++counts_.added;
  ++counts_.waiting;
  counts_.bytes += size_of(message);
  return message;
}

std::vector<Message> Backlog::take(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, timeout, [this] { return !queue_.empty() || !gap_.empty(); });
  std::vector<Message> batch;
  if (!gap_.empty()) batch.push_back(make_gap());
  for (std::size_t bytes = 0; !queue_.empty() && batch.size() < most_messages;) {
    bytes += size_of(queue_.front());
    if (bytes > most_batch_bytes && !batch.empty()) break;
    batch.push_back(std::move(queue_.front()));
    queue_.pop_front();
  }
  return batch;
}

void Backlog::done(const Message& message, bool is_lost) {
  const std::lock_guard lock(mutex_);
  if (is_lost) {
    drop(message);
    return;
  }
  ++counts_.carried;
  --counts_.waiting;
  counts_.bytes -= size_of(message);
}

Backlog::Counts Backlog::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace splid::forward
