#include "daemon/security/zap.hpp"

#include "daemon/security/curve_key.hpp"
#include "tests/fuzz/fuzz.hpp"

// A request of ZAP in any number of parts, each with its length in a byte before it: refused, or
// answered in six parts, and a key taken from none but CURVE's credentials of 32 bytes.

SPLID_FUZZ_TARGET(zap) {
  using namespace splid;
  using namespace splid::test;
  FuzzInput input(data, size);
  std::vector<std::string> parts;
  while (!input.empty()) {
    const auto part = input.take_bytes(input.take<std::uint8_t>());
    parts.emplace_back(reinterpret_cast<const char*>(part.data()), part.size());
  }
  const auto request = security::parse_zap_request(parts);
  if (!request) return 0;
  must(parts.size() == 6 + request->credentials.size(), "each part is somewhere");
  must(security::zap_parts(request->request_id, {}).at(1) == parts.at(1),
       "the answer has the request's id");
  const auto key = security::curve_key_of(*request);
  if (!key) return 0;
  must(parts.size() == 7 && parts.at(5) == "CURVE", "only CURVE gives a key");
  must(security::is_curve_key(*key), "32 bytes are a key");
  return 0;
}
