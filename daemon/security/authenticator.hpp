#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "daemon/security/allow_list.hpp"
#include "daemon/security/curve_key.hpp"
#include "daemon/security/refusals.hpp"
#include "daemon/security/zap.hpp"

namespace zmq {
class context_t;
class socket_t;
}  // namespace zmq

namespace splid::security {

// The room daemon/security decides who may connect: keys (curve_key.hpp), their files
// (key_file.hpp, guarded_file.hpp), the list of those who may connect (allow_list.hpp), and the
// check of each connection's key, which is in this class. Read this header first.

// Checks the key of everybody who connects to the sockets of one ZeroMQ context. It is the server's
// end of CURVE and the ZAP handler in one. It lets in those who prove that they have the secret key
// of a public key on the socket's allow-list, and nobody else, and reports those it refused.
//
// Threads: all calls from any thread, but protect() from the socket's. The authenticator's own
// thread decides on a connection before any message of it reaches a socket, so no socket waits for
// the decision; it takes a lock that no stage on the way of a tag takes. Errors: the constructor
// throws Error(Fault::device) where this machine's libzmq has no CURVE.
class Authenticator {
 public:
  // own: the server's keys. refusals: told, on the authenticator's thread, of each peer whose key
  // is not listed; outlives this.
  Authenticator(CurveKeyPair own, Refusals& refusals);
  ~Authenticator();
  Authenticator(const Authenticator&) = delete;
  Authenticator& operator=(const Authenticator&) = delete;

  // The context to make protected sockets in. They have to be closed before the authenticator ends.
  zmq::context_t& context();
  [[nodiscard]] const std::string& public_key() const { return own_.public_key; }

  // Sets the list of those who may connect to the sockets of a domain from now on; before the first
  // call nobody may. Open connections stay open: libzmq asks about a connection only once, when it
  // begins.
  void allow(const std::string& domain, AllowList list);
  [[nodiscard]] AllowList allowed(const std::string& domain) const;

  // Makes a socket check the keys of its peers. To be called before the socket binds: an endpoint
  // that it bound before stays open to everybody. Messages of a peer then carry the peer's name on
  // the allow-list as "User-Id".
  void protect(zmq::socket_t& socket, const std::string& domain);
  // Where a gate stands between the peers and the socket, every connection comes from the gate's
  // address. judged_peer tells then which peer's key is being checked at present, for the reports
  // of refusals. Null: no gate stands there.
  void name_peers(const std::string& domain, std::function<std::string()> judged_peer);

 private:
  struct Sockets;
  void serve();
  void answer();
  ZapReply judge(const ZapRequest& request);
  [[nodiscard]] std::optional<std::string> name_of(const std::string& domain,
                                                   const std::string& public_key) const;
  [[nodiscard]] std::string peer_of(const ZapRequest& request) const;

  const CurveKeyPair own_;
  Refusals& refusals_;
  std::unique_ptr<Sockets> sockets_;
  mutable std::mutex mutex_;
  std::map<std::string, AllowList> lists_;                            // guarded by mutex_
  std::map<std::string, std::function<std::string()>> judged_peers_;  // guarded by mutex_
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace splid::security
