#include "daemon/security/zap.hpp"

#include "daemon/security/curve_key.hpp"

namespace splid::security {
namespace {

constexpr const char* zap_version = "1.0";

// Parts before the credentials: version, request id, domain, address, routing id, mechanism.
constexpr std::size_t fixed_parts = 6;

}  // namespace

std::optional<ZapRequest> parse_zap_request(std::span<const std::string> parts) {
  if (parts.size() < fixed_parts || parts[0] != zap_version) return std::nullopt;
  const auto credentials = parts.subspan(fixed_parts);
  return ZapRequest{
      parts[1], parts[2], parts[3], parts[5], {credentials.begin(), credentials.end()}};
}

std::array<std::string, 6> zap_parts(const std::string& request_id, const ZapReply& reply) {
  return {zap_version, request_id,    std::to_string(static_cast<int>(reply.status)),
          reply.text,  reply.user_id, ""};
}

std::optional<std::string> curve_key_of(const ZapRequest& request) {
  if (request.mechanism != "CURVE" || request.credentials.size() != 1) return std::nullopt;
  const std::string& key = request.credentials.front();
  if (key.size() != curve_key_bytes) return std::nullopt;
  return curve_key_text(std::as_bytes(std::span(key)).first<curve_key_bytes>());
}

}  // namespace splid::security
