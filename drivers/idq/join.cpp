#include "drivers/idq/join.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace splid::idq {

Join::Join(std::size_t inputs, std::int64_t longest_ps)
    : longest_ps_(longest_ps), inputs_(inputs) {}

bool Join::add(std::size_t input, std::string_view message) {
  constexpr std::uint64_t disorder_ps = 1'000'000;  // as a stream of tags may have
  if (message.size() % sizeof(Times::value_type) != 0) return false;
  Times times(message.size() / sizeof(Times::value_type));
  if (!times.empty()) std::memcpy(times.data(), message.data(), message.size());
  std::uint64_t latest_ps = 0;
  for (const std::uint64_t time_ps : times) {
    if (time_ps > static_cast<std::uint64_t>(longest_ps_)) return false;
    if (time_ps + disorder_ps < latest_ps) return false;
    latest_ps = std::max(latest_ps, time_ps);
  }
  Input& of = inputs_.at(input);
  of.received += times.size();
  if (!times.empty()) of.messages.push_back(std::move(times));
  return true;
}

// That belong to the messages.
std::int64_t Join::ended(const Input& input) const {
  return input.acquisitions - next_ - static_cast<std::int64_t>(input.parts.size());
}

Join::Account Join::settle(std::size_t input, std::int64_t acquisitions, std::uint64_t times) {
  Input& of = inputs_.at(input);
  if (acquisitions < of.acquisitions || times < of.times) return Account::fell;
  of.acquisitions = acquisitions;
  of.times = times;
  const std::int64_t count = ended(of);
  const auto messages = static_cast<std::int64_t>(of.messages.size());
  if (times != of.received || messages > count) return Account::open;
  if (messages == count) {
    for (Times& message : of.messages) of.parts.push_back({std::move(message), false});
    of.messages.clear();
  } else if (messages == 0) {
    of.parts.resize(of.parts.size() + static_cast<std::size_t>(count));
  } else {
    put_lacking(of);  // some saw nothing, and nothing tells which
  }
  return Account::settled;
}

std::int64_t Join::give_up(std::size_t input) {
  Input& of = inputs_.at(input);
  const std::int64_t count = ended(of);
  of.received = of.times;
  put_lacking(of);
  return count;
}

void Join::put_lacking(Input& input) const {
  for (std::int64_t left = ended(input); left > 0; --left) input.parts.push_back({{}, true});
  input.messages.clear();
}

void Join::doubt() {
  for (const Input& input : inputs_) doubtful_ = std::max(doubtful_, input.acquisitions);
}

std::optional<SubAcquisition> Join::take() {
  const auto is_ready = [](const Input& input) { return !input.parts.empty(); };
  if (!std::all_of(inputs_.begin(), inputs_.end(), is_ready)) return std::nullopt;
  SubAcquisition whole{next_, {}, next_ <= doubtful_};
  ++next_;
  for (Input& input : inputs_) {
    whole.lacks = whole.lacks || input.parts.front().lacks;
    whole.of_input.push_back(std::move(input.parts.front().times));
    input.parts.pop_front();
  }
  return whole;
}

}  // namespace splid::idq
