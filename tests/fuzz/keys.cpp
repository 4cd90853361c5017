#include <algorithm>

#include "daemon/security/allow_list.hpp"
#include "daemon/security/curve_key.hpp"
#include "daemon/security/key_file.hpp"
#include "tests/fuzz/fuzz.hpp"

// A file of a public key, of a secret one, and an allow-list: each read, or refused with its name
// in the sentence.

namespace splid::test::fuzz_keys {
namespace {

void check_list(const std::string& text) {
  security::AllowList list;
  if (!accepts(Fault::usage, [&] { list = security::AllowList::parse(text, "/f/list"); })) return;
  const auto lines = 1 + std::count(text.begin(), text.end(), '\n');
  must(list.size() <= static_cast<std::size_t>(lines), "a key has a line");
  must(list.missing_in(list) == 0, "a list lacks none of its keys");
  must(list.missing_in(security::AllowList{}) == list.size(), "an empty list lacks all");
  must(!list.name_of(text.substr(0, 39)), "half a key is on no list");
}

void check(const std::string& text) {
  std::string key;
  if (accepts(Fault::usage, [&] { key = security::parse_public_key(text, "/f/k"); })) {
    must(security::is_curve_key(key), "a public key is one");
    must(security::AllowList::parse(key + " name", "/f/list").name_of(key) == "name",
         "a public key can stand on a list");
  }
  security::CurveKeyPair keys;
  if (accepts(Fault::usage, [&] { keys = security::parse_secret_key(text, "/f/k"); })) {
    must(security::is_curve_key(keys.secret_key) && security::is_curve_key(keys.public_key),
         "keys are keys");
  }
  check_list(text);
}

}  // namespace
}  // namespace splid::test::fuzz_keys

SPLID_FUZZ_TARGET(keys) {
  splid::test::fuzz_keys::check(splid::test::as_text(data, size));
  return 0;
}
