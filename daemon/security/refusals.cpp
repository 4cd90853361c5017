#include "daemon/security/refusals.hpp"

namespace splid::security {

const char* to_string(Refusal reason) {
  switch (reason) {
    case Refusal::not_listed:
      return "not_listed";
    case Refusal::no_key:
      return "no_key";
    case Refusal::broken_off:
      return "broken_off";
    case Refusal::other_protocol:
      return "other_protocol";
    case Refusal::crowd:
      return "crowd";
    case Refusal::flood:
      return "flood";
  }
  return "";
}

void Refusals::add(Refusal reason, const std::string& peer, const std::string& sentence) {
  add(reason);
  tick();
  const std::scoped_lock lock(mutex_);
  Minute& minute = minutes_.at(static_cast<std::size_t>(reason));
  if (minute.peers.empty()) minute.begin_ns = clock_->steady_ns();
  if (minute.peers.size() < sentences_a_reason && minute.peers.insert(peer).second) {
    notice_(sentence);
    return;
  }
  ++minute.unsaid;
  minute.last = sentence;
}

void Refusals::tick() {
  const std::int64_t now_ns = clock_->steady_ns();
  const std::scoped_lock lock(mutex_);
  for (Minute& minute : minutes_) {
    if (minute.peers.empty() || now_ns - minute.begin_ns < minute_ns) continue;
    if (minute.unsaid > 0) {
      notice_(std::to_string(minute.unsaid) + " more within a minute, the last: " + minute.last);
    }
    minute = Minute{};
  }
}

std::uint64_t Refusals::kept_out() const {
  return count(Refusal::not_listed) + count(Refusal::no_key) + count(Refusal::broken_off) +
         count(Refusal::other_protocol);
}

std::uint64_t Refusals::let_go() const { return count(Refusal::crowd) + count(Refusal::flood); }

}  // namespace splid::security
