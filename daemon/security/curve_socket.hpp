#pragma once

#include <string>

#include "daemon/security/curve_key.hpp"

namespace zmq {
class socket_t;
}

namespace splid::security {

// The keys of a client, and the key of the server that it wants to talk to.
struct CurveClient {
  CurveKeyPair own;
  std::string server_key;  // the server's public key
};

// From now on `socket` connects only to a server that has the secret key of client.server_key.
// Errors of both functions: Error(Fault::device) where this machine's libzmq has no CURVE.
void use_as_curve_client(zmq::socket_t& socket, const CurveClient& client);

// Endpoints that `socket` binds from now on speak CURVE and ask the context's ZAP handler about
// each peer; without a handler nobody gets in. Endpoints bound before stay as they are.
void use_as_curve_server(zmq::socket_t& socket, const std::string& secret_key,
                         const std::string& zap_domain);

}  // namespace splid::security
