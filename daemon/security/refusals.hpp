#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "daemon/base/clock.hpp"

namespace splid {

// Why somebody is not let in, or let go.
enum class Refusal : std::uint8_t {
  not_listed,      // the key is not on the allow-list
  no_key,          // it asks without CURVE, or with it where there is none
  broken_off,      // a handshake for another server's key, a repeated one, one that has no end
  other_protocol,  // it is no ZMTP 3
  crowd,           // more connections than one peer, or all, may have
  flood,           // it sent more than there is to say
};
inline constexpr std::size_t refusal_reasons = 6;

const char* to_string(Refusal reason);

// Counts who was refused, and says it without letting them fill the log: within a minute each peer
// once for a reason, five peers for each; of the others how many there were at the minute's end.
//
// Threads: any.
class Refusals {
 public:
  static constexpr std::size_t sentences_a_reason = 5;
  static constexpr std::int64_t minute_ns = 60'000'000'000;

  // notice: takes a sentence, on the thread that calls. clock: outlives this.
  Refusals(std::function<void(const std::string&)> notice, const Clock& clock)
      : notice_(std::move(notice)), clock_(&clock) {}

  // peer: who; sentence: about it.
  void add(Refusal reason, const std::string& peer, const std::string& sentence);
  // One that is not worth a sentence.
  void add(Refusal reason) { ++counts_.at(static_cast<std::size_t>(reason)); }
  // To be called once a second or so: ends the minute.
  void tick();

  [[nodiscard]] std::uint64_t count(Refusal reason) const {
    return counts_.at(static_cast<std::size_t>(reason));
  }
  // Connections that did not come about, for want of a key or a handshake.
  [[nodiscard]] std::uint64_t kept_out() const;
  // Connections that were cut off, or not taken, since they were too many or sent too much.
  [[nodiscard]] std::uint64_t let_go() const;

 private:
  struct Minute {
    std::int64_t begin_ns = 0;
    std::set<std::string> peers;  // of whom was said; none: no minute has begun
    std::uint64_t unsaid = 0;
    std::string last;  // of these
  };

  std::function<void(const std::string&)> notice_;
  const Clock* clock_;
  std::array<std::atomic<std::uint64_t>, refusal_reasons> counts_{};
  std::mutex mutex_;
  std::array<Minute, refusal_reasons> minutes_;  // guarded by mutex_
};

}  // namespace splid
