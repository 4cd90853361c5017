#pragma once

#include <functional>
#include <memory>
#include <string>

#include "config/security_options.hpp"
#include "daemon/security/authenticator.hpp"

namespace splid::security {

// The domains of publish.endpoint and control.endpoint. Each has an allow-list of its own, so that
// somebody who may read results may not also stop the instrument.
inline constexpr const char* publish_domain = "publish";
inline constexpr const char* control_domain = "control";

// Opens the authenticator that the configuration's `security` asks for, with the key and the
// allow-list from their files. Null where no key is configured. notice: takes a sentence where the
// list is empty. refusals: as Authenticator's. Errors: Error(Fault::usage) for the files
// (key_file.hpp, allow_list.hpp).
std::unique_ptr<Authenticator> open_authenticator(
    const SecurityOptions& options, const std::function<void(const std::string&)>& notice,
    Refusals& refusals);

// Gives a domain another allow-list. Returns a sentence about what has changed; empty where nothing
// has. Errors: none.
std::string change_allow_list(Authenticator& authenticator, const std::string& domain,
                              AllowList next);

}  // namespace splid::security
