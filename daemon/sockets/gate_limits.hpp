#pragma once

#include <cstddef>
#include <cstdint>

namespace splid {

// How much may be sent.
struct Allowance {
  std::int64_t frames = 0;  // of ZMTP
  std::int64_t bytes = 0;   // with their headers
};

inline constexpr std::int64_t kib = 1024;

// What a gate lets through to the ZeroMQ socket behind it.
//
// Design note: libzmq makes up to 2.4 KiB of two subscriptions of three bytes (a table of 256
// pointers where two topics part, and a set a topic), and 32 times their length of long ones. So
// what a peer may have sent bounds what it can take: 16,000 frames or 128 KiB are at most 20 and 4
// MiB, with what its connections take by themselves less than 64 MiB. It is all given back when
// they end.
//
// Whenever a connection ends, libzmq goes through the topics of all, on the thread that sends to
// subscribers. With 32 KiB a connection and 300 of them at once, 500 floods kept that thread busy
// for 40 s, and took 155 MiB; so a connection has 4 KiB, which is 80 topics over CURVE, and each
// flood counts as 20 new connections.
struct GateLimits {
  std::size_t connections = 0;
  std::size_t connections_a_peer = 0;
  double new_connections_a_second = 0;  // of a peer, in the long run
  double new_connections_at_once = 0;
  double connections_a_flood = 0;  // new ones that a flood counts as
  std::uint64_t frame_bytes = 0;   // the longest body
  Allowance connection;            // outstanding
  Allowance peer;                  // of all its connections together
  // What each frame that goes to the peer gives back. To a subscriber go heartbeats and messages of
  // a short part, the topic, and a long one; it answers a heartbeat or is answered, one for one,
  // and a message neither. To a client of control go answers.
  Allowance back_for_short;
  Allowance back_for_long;
};

// Bytes of the longest short body: a topic under CURVE, which adds 33. JSON messages are longer.
inline constexpr std::uint64_t longest_short_body = 133;

// CURVE's part of a frame's body.
inline constexpr std::uint64_t curve_bytes = 33;

inline constexpr GateLimits subscriber_limits{
    .connections = 128,
    .connections_a_peer = 64,
    .new_connections_a_second = 20,
    .new_connections_at_once = 100,
    .connections_a_flood = 20,
    .frame_bytes = 1024 + curve_bytes,
    .connection = {1000, 4 * kib},
    .peer = {16'000, 128 * kib},
    .back_for_short = {1, 64},
    .back_for_long = {-1, -64},
};

inline constexpr GateLimits control_limits{
    .connections = 64,
    .connections_a_peer = 32,
    .new_connections_a_second = 500,
    .new_connections_at_once = 500,
    .connections_a_flood = 20,
    .frame_bytes = 4096 + curve_bytes,
    .connection = {2000, 1024 * kib},
    .peer = {8000, 8192 * kib},
    .back_for_short = {3, 16 * kib},
    .back_for_long = {3, 16 * kib},
};

}  // namespace splid
