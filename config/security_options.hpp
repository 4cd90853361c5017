#pragma once

#include <optional>
#include <string>

#include "protocol/options.hpp"

namespace splid {

// Whether an endpoint that other machines can reach may be without keys.
enum class Unprotected { no, anyone_may_read };

// Who may connect from other machines. With a server's key, publish.endpoint speaks CURVE, wherever
// it is, and lets in whom the allow-list names. Without a key the endpoint must be on this machine,
// unless `unprotected` says otherwise. JSON: `security`.
struct SecurityOptions {
  std::string server_key;  // file of the server's secret key; empty: none
  std::string allow_list;  // file of public keys; empty: none
  Unprotected unprotected = Unprotected::no;
  void describe(OptionVisitor& visitor);
  // A fault where one of key and list is missing: a key without a list would keep everybody out,
  // and a list without a key would keep nobody out.
  [[nodiscard]] std::optional<OptionFault> validate() const;
  // What is wrong with binding a valid endpoint under these options; absent: nothing.
  [[nodiscard]] std::optional<std::string> endpoint_fault(const std::string& endpoint) const;
};

}  // namespace splid
