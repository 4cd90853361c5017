#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "daemon/clock.hpp"
#include "daemon/security/allow_list.hpp"
#include "daemon/security/curve_key.hpp"
#include "daemon/security/refusal_log.hpp"
#include "daemon/security/socket_monitor.hpp"
#include "daemon/security/zap.hpp"

namespace splid {

// Decides who may connect to the sockets of one context: the server's end of CURVE and the ZAP
// handler in one. Lets in who proves to have the secret of a key on the socket's allow-list, and
// nobody else; counts the others and says who they were.
//
// Threads: all calls from any; protect() and release() on the socket's. A thread of its own decides
// on a connection before anything of it reaches a socket, so no socket waits for it; it takes a
// lock that no stage on the way of a tag takes. Errors: the constructor throws Error(Fault::device)
// where CURVE is not to be had.
class Authenticator {
 public:
  // own: the server's keys. notice: takes a sentence about a refusal, on the thread above, six a
  // minute at most (RefusalLog).
  Authenticator(CurveKeyPair own, std::function<void(const std::string&)> notice,
                const Clock& clock);
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
  // Before it is closed.
  void release(zmq::socket_t& socket);

  // Connections that did not come about, since the start.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  struct Sockets;
  void serve();
  void answer();
  ZapReply judge(const ZapRequest& request);
  [[nodiscard]] std::optional<std::string> name_of(const std::string& domain,
                                                   const std::string& public_key) const;
  void look_at_handshakes();
  void refuse(const std::string& sentence);

  const CurveKeyPair own_;
  const Clock& clock_;
  std::unique_ptr<Sockets> sockets_;
  mutable std::mutex mutex_;
  std::map<std::string, AllowList> lists_;                             // guarded by mutex_
  std::map<zmq::socket_t*, std::unique_ptr<SocketMonitor>> monitors_;  // guarded by mutex_
  RefusalLog log_;                                                     // the thread's
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace splid
