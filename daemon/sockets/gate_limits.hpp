#pragma once

#include <cstddef>
#include <cstdint>

namespace splid::sockets {

// An amount of traffic that a peer may send.
struct Allowance {
  std::int64_t frames = 0;  // ZMTP frames
  std::int64_t bytes = 0;   // of these frames, headers included
};

inline constexpr std::int64_t kib = 1024;

// How much a gate lets through to the ZeroMQ socket behind it.
//
// Design note: libzmq takes up to 2.4 KiB of memory for two subscriptions of three bytes (a table
// of 256 pointers at the place where two topics differ, and a set for each topic), and for long
// topics 32 times their length. So the traffic that a peer may send bounds the memory that it can
// take: 16,000 frames take at most 20 MiB and 128 KiB at most 4 MiB; together with what its
// connections take by themselves a peer takes less than 64 MiB. The memory is free again when the
// connections end.
//
// Whenever a connection ends, libzmq goes through the topics of all connections, on the thread that
// sends to subscribers. With 32 KiB for each connection and 300 connections at once, 500 floods
// kept that thread busy for 40 s and took 155 MiB. So a connection has 4 KiB, which are 80 topics
// over CURVE, and each flood counts as 20 new connections.
struct GateLimits {
  std::size_t connections = 0;
  std::size_t connections_a_peer = 0;
  double new_connections_a_second = 0;  // of a peer, in the long run
  double new_connections_at_once = 0;   // of a peer, after a quiet time
  double connections_a_flood = 0;       // how many new connections a flood counts as
  std::uint64_t frame_bytes = 0;        // length of the longest allowed body
  Allowance connection;                 // that one connection may have outstanding
  Allowance peer;  // that all connections of a peer together may have outstanding
  // How much each frame sent to the peer takes off the peer's outstanding traffic. A subscriber is
  // sent heartbeats and messages. Each heartbeat is answered by one heartbeat, in either direction.
  // A message has a short part, the topic, and a long part; it neither is an answer nor gets one,
  // so its long part cancels what its short part took off. A control client is sent replies.
  Allowance back_for_short;
  Allowance back_for_long;
};

// Bytes of the longest body that counts as short: a topic with the 33 bytes that CURVE adds. JSON
// messages are longer.
inline constexpr std::uint64_t longest_short_body = 133;

// Bytes that CURVE adds to a frame's body.
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

}  // namespace splid::sockets
