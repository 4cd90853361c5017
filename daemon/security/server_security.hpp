#pragma once

#include <functional>
#include <memory>
#include <string>

#include "config/security_options.hpp"
#include "daemon/security/authenticator.hpp"

namespace splid {

// The domains of publish.endpoint and control.endpoint, each with an allow-list of its own: who may
// read results may not therefore stop the instrument.
inline constexpr const char* publish_domain = "publish";
inline constexpr const char* control_domain = "control";

// What `security` asks for: reads the key and the allow-list. Null without a key.
// notice: takes a sentence, if the list is empty. refusals: as Authenticator's. Errors:
// Error(Fault::usage) of the files (key_file.hpp, allow_list.hpp).
std::unique_ptr<Authenticator> open_authenticator(
    const SecurityOptions& options, const std::function<void(const std::string&)>& notice,
    Refusals& refusals);

// Takes a domain's allow-list as it is in its file now; says in a sentence what is new, empty:
// nothing. Errors: Error(Fault::usage), and the list is as before.
std::string reload_allow_list(Authenticator& authenticator, const std::string& domain,
                              const std::string& file);

}  // namespace splid
