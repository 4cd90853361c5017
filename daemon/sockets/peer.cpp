#include "daemon/sockets/peer.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstring>

namespace splid::sockets {
namespace {

std::string address_text(int family, const void* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  return inet_ntop(family, address, text.data(), text.size()) == nullptr ? "somebody" : text.data();
}

Peer of_ipv6(const in6_addr& address) {
  if (IN6_IS_ADDR_V4MAPPED(&address)) {
    constexpr std::size_t ipv4_at = 12;
    const std::string name = address_text(AF_INET, &address.s6_addr[ipv4_at]);
    return {name, name};
  }
  in6_addr network{};
  constexpr std::size_t network_bytes = 8;
  std::memcpy(&network, &address, network_bytes);
  return {address_text(AF_INET6, &address), address_text(AF_INET6, &network)};
}

Peer of_user(int socket) {
  ucred who{};
  socklen_t size = sizeof who;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &who, &size) != 0) {
    return {"somebody", "somebody"};
  }
  const std::string name = "user " + std::to_string(who.uid);
  return {name, name};
}

}  // namespace

Peer peer_of(int socket) {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (::getpeername(socket, reinterpret_cast<sockaddr*>(&storage), &size) != 0) {
    return {"somebody", "somebody"};
  }
  if (storage.ss_family == AF_UNIX) return of_user(socket);
  if (storage.ss_family == AF_INET6) {
    return of_ipv6(reinterpret_cast<const sockaddr_in6&>(storage).sin6_addr);
  }
  const std::string name =
      address_text(AF_INET, &reinterpret_cast<const sockaddr_in&>(storage).sin_addr);
  return {name, name};
}

}  // namespace splid::sockets
