#pragma once

#include <memory>

#include "config/config.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/service/session.hpp"

namespace splid::security {
class Refusals;
}  // namespace splid::security

namespace splid {

// The publisher that the options ask for, at the configured endpoints. Where another program has an
// endpoint and frames are printed too, the publisher is bound nowhere and the log has a warning.
//
// authenticator: null where nobody needs keys. refusals: hears who is let go. Both outlive the
// publisher.
// Errors: as the Publisher's constructor. The error of an endpoint that is taken says which splid
// publishes there, if a splid answers within a second, and how to go on.
std::unique_ptr<Publisher> open_publisher(const Config& config, const SessionOptions& options,
                                          security::Authenticator* authenticator,
                                          security::Refusals& refusals);

}  // namespace splid
