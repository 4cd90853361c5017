#include "daemon/security/server_security.hpp"

#include <utility>

#include "daemon/security/key_file.hpp"
#include "protocol/error.hpp"

namespace splid::security {
namespace {

std::string keys_in_words(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " key" : " keys");
}

}  // namespace

std::unique_ptr<Authenticator> open_authenticator(
    const SecurityOptions& options, const std::function<void(const std::string&)>& notice,
    Refusals& refusals) {
  if (options.server_key.empty()) return nullptr;
  AllowList list =
      asked_by("/security/allow_list", [&] { return AllowList::read(options.allow_list); });
  CurveKeyPair keys =
      asked_by("/security/server_key", [&] { return read_secret_key(options.server_key); });
  if (list.size() == 0) notice("nobody may connect: " + options.allow_list + " has no key");
  auto authenticator = std::make_unique<Authenticator>(std::move(keys), refusals);
  authenticator->allow(publish_domain, std::move(list));
  return authenticator;
}

std::string change_allow_list(Authenticator& authenticator, const std::string& domain,
                              AllowList next) {
  const AllowList before = authenticator.allowed(domain);
  const std::size_t added = next.missing_in(before);
  const std::size_t removed = before.missing_in(next);
  authenticator.allow(domain, std::move(next));
  const std::string begin = domain == publish_domain ? "allow-list: " : "control's allow-list: ";
  std::string sentence;
  if (added > 0) sentence = begin + keys_in_words(added) + " added";
  if (removed > 0) {
    sentence += (sentence.empty() ? begin : ", ") + keys_in_words(removed) +
                " removed, whose open connections last until they end or splid is restarted";
  }
  return sentence;
}

}  // namespace splid::security
