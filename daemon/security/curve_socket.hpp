#pragma once

#include <string>

#include "daemon/security/curve_key.hpp"

namespace zmq {
class socket_t;
}

namespace splid {

// Who a client is, and which server it takes for the right one.
struct CurveClient {
  CurveKeyPair own;
  std::string server_key;  // the server's public one
};

// What `socket` connects to from here on has to be the server with that key.
// Errors of both: Error(Fault::device) where the machine's libzmq has no CURVE.
void use_as_curve_client(zmq::socket_t& socket, const CurveClient& client);

// What `socket` binds from here on speaks CURVE and asks the context's ZAP handler about everybody;
// without one, nobody gets in. What it has bound before stays as it is.
void use_as_curve_server(zmq::socket_t& socket, const std::string& secret_key,
                         const std::string& zap_domain);

}  // namespace splid
