#include "config/hidden_keys.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string_view>

namespace splid {
namespace {

constexpr std::string_view unusual =
    ":+=^!*?&<>()[]{}@%$#";  // characters of Z85 that names seldom have
constexpr std::ptrdiff_t least_run = 36;
constexpr std::ptrdiff_t least_unusual = 2;

bool is_unusual(char c) { return unusual.find(c) != std::string_view::npos; }

bool is_of_key(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '/' ||
         is_unusual(c);
}

}  // namespace

std::string hide_keys(const std::string& text) {
  std::string hidden;
  for (auto at = text.begin(); at != text.end();) {
    const auto end = std::find_if_not(at, text.end(), is_of_key);
    const bool may_be_key =
        end - at >= least_run && std::count_if(at, end, is_unusual) >= least_unusual;
    if (may_be_key) {
      hidden += "(a key?)";
    } else {
      hidden.append(at, end);
    }
    at = end;
    if (at != text.end()) hidden += *at++;
  }
  return hidden;
}

}  // namespace splid
