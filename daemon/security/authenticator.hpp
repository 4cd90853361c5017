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

namespace splid {

// Decides who may connect to the sockets of one context: the server's end of CURVE and the ZAP
// handler in one. Lets in who proves to have the secret of a key on the socket's allow-list, and
// nobody else; says who the others were.
//
// Threads: all calls from any; protect() on the socket's. A thread of its own decides
// on a connection before anything of it reaches a socket, so no socket waits for it; it takes a
// lock that no stage on the way of a tag takes. Errors: the constructor throws Error(Fault::device)
// where CURVE is not to be had.
class Authenticator {
 public:
  // own: the server's keys. refusals: hears of those whose key is not listed, on the thread above;
  // outlives this.
  Authenticator(CurveKeyPair own, Refusals& refusals);
  ~Authenticator();
  Authenticator(const Authenticator&) = delete;
  Authenticator& operator=(const Authenticator&) = delete;

  // For the sockets that it protects, which are to be closed before it ends.
  zmq::context_t& context();
  [[nodiscard]] const std::string& public_key() const { return own_.public_key; }

  // Who may connect to the sockets of a domain from now on; by default nobody. Connections that are
  // open stay so: libzmq asks once, at their beginning.
  void allow(const std::string& domain, AllowList list);
  [[nodiscard]] AllowList allowed(const std::string& domain) const;

  // Before it binds; what it bound before stays open to all. Its peers' messages carry the name
  // that the allow-list gives them as "User-Id".
  void protect(zmq::socket_t& socket, const std::string& domain);
  // Who is asked about in a domain now, where a gate stands between the peers and the socket, so
  // that all have the gate's address. Null: nobody tells.
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

}  // namespace splid
