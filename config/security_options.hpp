#pragma once

#include <optional>
#include <string>

#include "protocol/options.hpp"

namespace splid {

// What an endpoint beyond this machine may be without keys.
enum class Unprotected { no, anyone_may_read };

// Who may connect from elsewhere. With a key publish.endpoint speaks CURVE, wherever it is, and
// lets in whom the allow-list names; without one it has to be on this machine, unless `unprotected`
// says otherwise. JSON: `security`.
struct SecurityOptions {
  std::string server_key;  // file of the server's secret key; empty: none
  std::string allow_list;  // file of public keys; empty: none
  Unprotected unprotected = Unprotected::no;
  void describe(OptionVisitor& visitor);
  // A key without a list would keep everybody out, a list without a key nobody.
  [[nodiscard]] std::optional<OptionFault> validate() const;
  // What is wrong with binding `endpoint`, which is valid, under these options; absent: nothing.
  [[nodiscard]] std::optional<std::string> endpoint_fault(const std::string& endpoint) const;
};

}  // namespace splid
