#include "config/security_options.hpp"

#include <array>

#include "config/endpoint.hpp"
#include "config/hidden_keys.hpp"

namespace splid {

void SecurityOptions::describe(OptionVisitor& visitor) {
  static constexpr std::array<const char*, 2> in_words = {"no", "anyone on the network may read"};
  visitor.path("server_key", server_key,
               "file of the server's secret key, made by splid keys and readable by the service "
               "only; with it publish.endpoint speaks CURVE with the keys of allow_list");
  visitor.path(
      "allow_list", allow_list,
      "file of the public keys that may connect, a line each: KEY name; read again on SIGHUP");
  choose(visitor, "unprotected", unprotected, in_words,
         "allows a publish.endpoint for other machines without server_key");
}

std::optional<OptionFault> SecurityOptions::validate() const {
  if (hide_keys(server_key) != server_key) {
    return OptionFault{"/server_key",
                       "looks like a key itself, which is not shown here; it has to name the "
                       "file that holds one, which splid keys makes. Take a new key if others may "
                       "have read this configuration"};
  }
  if (!server_key.empty() && allow_list.empty()) {
    return OptionFault{"/allow_list",
                       "\"\" names no file, but /security/server_key is given; write the public "
                       "keys that may connect into a file and name it here"};
  }
  if (server_key.empty() && !allow_list.empty()) {
    return OptionFault{"/server_key",
                       "\"\" names no file, so /security/allow_list would keep nobody out; make a "
                       "key with splid keys and name its .key_secret file here"};
  }
  if (!server_key.empty() && unprotected != Unprotected::no) {
    return OptionFault{"/unprotected",
                       "contradicts /security/server_key, with which only those on the allow-list "
                       "may read; remove one of them"};
  }
  return std::nullopt;
}

std::optional<std::string> SecurityOptions::endpoint_fault(const std::string& endpoint) const {
  if (!server_key.empty() || unprotected == Unprotected::anyone_may_read ||
      is_on_this_machine(endpoint)) {
    return std::nullopt;
  }
  return "\"" + endpoint +
         "\" would offer the results to anyone on the network, without encryption; set "
         "/security/server_key and /security/allow_list (docs/guide/security.md), or allow it with "
         "\"security\":{\"unprotected\":\"anyone on the network may read\"}";
}

}  // namespace splid
