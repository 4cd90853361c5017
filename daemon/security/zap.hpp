#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace splid::security {

// The request in which libzmq asks whether a peer may connect (RFC 27/ZAP), and the reply.

inline constexpr const char* zap_endpoint = "inproc://zeromq.zap.01";

struct ZapRequest {
  std::string request_id;
  std::string domain;     // of the socket
  std::string address;    // of the peer, as the kernel reports it
  std::string mechanism;  // "CURVE", "PLAIN", "NULL", "GSSAPI"
  std::vector<std::string> credentials;
};

struct ZapReply {
  enum class Status { admitted = 200, refused = 400, malformed = 500 };
  Status status = Status::refused;
  std::string text;     // sent to the peer, so it holds no secret
  std::string user_id;  // "User-Id" of every message that the peer sends
};

// parts: of one request, without the envelope. Absent where they are no request of version 1.0.
std::optional<ZapRequest> parse_zap_request(std::span<const std::string> parts);

// The parts of the reply to the request with that id.
std::array<std::string, 6> zap_parts(const std::string& request_id, const ZapReply& reply);

// The public key that a client proved to have the secret of, in Z85; absent where the request is
// not of CURVE or its credentials are no key.
std::optional<std::string> curve_key_of(const ZapRequest& request);

}  // namespace splid::security
