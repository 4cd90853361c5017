#include "daemon/security/curve_socket.hpp"

#include <zmq.hpp>

#include "protocol/error.hpp"

namespace splid::security {
namespace {

// zmq.h of libzmq 4.3 names this option only among its drafts, but the library takes it in any
// case. Without the option, libzmq lets in everybody who has the server's public key while no ZAP
// handler is bound.
constexpr int zap_enforce_domain = 93;

// A handshake takes three round trips. A peer that does not finish it holds a file descriptor for
// this long; libzmq's default is 30 s.
constexpr int handshake_ms = 5000;

[[noreturn]] void throw_no_curve(const zmq::error_t& error) {
  throw Error(Fault::device, std::string("CURVE: ") + error.what() +
                                 "; this machine's libzmq has to be 4.3 or later, built with "
                                 "libsodium, as Debian's libzmq5 is");
}

void enforce_domain(zmq::socket_t& socket) {
  const int yes = 1;
  if (zmq_setsockopt(socket.handle(), zap_enforce_domain, &yes, sizeof yes) != 0) {
    throw zmq::error_t();
  }
}

}  // namespace

void use_as_curve_client(zmq::socket_t& socket, const CurveClient& client) {
  try {
    socket.set(zmq::sockopt::curve_serverkey, client.server_key);
    socket.set(zmq::sockopt::curve_publickey, client.own.public_key);
    socket.set(zmq::sockopt::curve_secretkey, client.own.secret_key);
  } catch (const zmq::error_t& error) {
    throw_no_curve(error);
  }
}

void use_as_curve_server(zmq::socket_t& socket, const std::string& secret_key,
                         const std::string& zap_domain) {
  try {
    socket.set(zmq::sockopt::curve_server, true);
    socket.set(zmq::sockopt::curve_secretkey, secret_key);
    socket.set(zmq::sockopt::zap_domain, zap_domain);
    enforce_domain(socket);
    socket.set(zmq::sockopt::handshake_ivl, handshake_ms);
  } catch (const zmq::error_t& error) {
    throw_no_curve(error);
  }
}

}  // namespace splid::security
