#pragma once

#include <functional>
#include <memory>
#include <string>

#include "config/security_options.hpp"
#include "daemon/security/authenticator.hpp"

namespace splid {

// The domain of publish.endpoint.
inline constexpr const char* publish_domain = "publish";

// What `security` asks for: reads the key and the allow-list. Null without a key.
// notice: as Authenticator's. Errors: Error(Fault::usage) of the files (key_file.hpp,
// allow_list.hpp).
std::unique_ptr<Authenticator> open_authenticator(
    const SecurityOptions& options, const std::function<void(const std::string&)>& notice,
    const Clock& clock);

// Takes the allow-list as it is in its file now; says in a sentence what is new, empty: nothing.
// Errors: Error(Fault::usage), and the list is as before.
std::string reload_allow_list(Authenticator& authenticator, const SecurityOptions& options);

}  // namespace splid
