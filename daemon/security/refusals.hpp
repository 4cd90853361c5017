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

namespace splid::security {

// Why a peer is not let in, or is disconnected.
enum class Refusal : std::uint8_t {
  not_listed,      // the key is not on the allow-list
  no_key,          // the peer asks without CURVE where the socket has CURVE, or the reverse
  broken_off,      // a handshake for another server's key, or a repeated or an endless handshake
  other_protocol,  // the peer does not speak ZMTP 3
  crowd,           // more connections than one peer, or all peers together, may have
  flood,           // the peer sent more than a peer has to say
};
inline constexpr std::size_t refusal_reasons = 6;

const char* to_string(Refusal reason);

// Counts refusals and reports them without filling the log. Within a minute and for each reason,
// the first five peers get one sentence each; at the minute's end another sentence says how many
// other refusals there were.
//
// Threads: any.
class Refusals {
 public:
  static constexpr std::size_t sentences_a_reason = 5;
  static constexpr std::int64_t minute_ns = 60'000'000'000;

  // notice: takes a sentence, on the thread that calls add() or tick(). clock: outlives this.
  Refusals(std::function<void(const std::string&)> notice, const Clock& clock)
      : notice_(std::move(notice)), clock_(&clock) {}

  // peer: the name that tells peers apart. sentence: what to report about the peer.
  void add(Refusal reason, const std::string& peer, const std::string& sentence);
  // Counts a refusal without a sentence.
  void add(Refusal reason) { ++counts_.at(static_cast<std::size_t>(reason)); }
  // To be called about once a second: ends the minutes that are over.
  void tick();

  [[nodiscard]] std::uint64_t count(Refusal reason) const {
    return counts_.at(static_cast<std::size_t>(reason));
  }
  // Connections that never came about: the key or the handshake was not right.
  [[nodiscard]] std::uint64_t kept_out() const;
  // Connections that were cut off or not accepted, because there were too many or they sent too
  // much.
  [[nodiscard]] std::uint64_t let_go() const;

 private:
  struct Minute {
    std::int64_t begin_ns = 0;
    std::set<std::string> peers;  // that got a sentence; empty: no minute has begun
    std::uint64_t unsaid = 0;     // refusals without a sentence
    std::string last;             // the sentence of the last of these
  };

  std::function<void(const std::string&)> notice_;
  const Clock* clock_;
  std::array<std::atomic<std::uint64_t>, refusal_reasons> counts_{};
  std::mutex mutex_;
  std::array<Minute, refusal_reasons> minutes_;  // guarded by mutex_
};

}  // namespace splid::security
