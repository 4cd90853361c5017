#include "tests/support/matches.hpp"

#include <regex>

namespace splid::test {

std::vector<std::string> first_match(const std::string& text, const std::string& pattern) {
  std::smatch found;
  std::regex_search(text, found, std::regex(pattern));
  return {found.begin(), found.end()};
}

std::vector<std::string> all_matches(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  std::vector<std::string> matches;
  for (std::sregex_iterator at(text.begin(), text.end(), expression), end; at != end; ++at) {
    matches.push_back(at->str());
  }
  return matches;
}

std::string without_matches(const std::string& text, const std::string& pattern) {
  return std::regex_replace(text, std::regex(pattern), "");
}

}  // namespace splid::test
