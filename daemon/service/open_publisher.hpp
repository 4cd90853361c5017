#pragma once

#include <memory>

#include "config/config.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/service/session.hpp"

namespace splid {

class Refusals;

// The publisher that the options ask for, at the configured endpoints. Where another program has
// one of them and frames are printed too, one that is bound nowhere, and a warning in the log.
//
// authenticator: null where nobody needs keys. refusals: hears who is let go. Both outlive the
// publisher.
// Errors: as Publisher; of an endpoint that is taken, it says which splid publishes there, if one
// answers within a second, and how to go on.
std::unique_ptr<Publisher> open_publisher(const Config& config, const SessionOptions& options,
                                          Authenticator* authenticator, Refusals& refusals);

}  // namespace splid
