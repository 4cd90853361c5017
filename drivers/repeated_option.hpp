#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocol/options.hpp"

namespace splid {

// The fault of a list with two members that have the same number; absent where there are none.
template <class Member, class Number>
std::optional<OptionFault> repeated_option(const std::vector<Member>& members,
                                           Number Member::*number, const std::string& list,
                                           const std::string& key) {
  std::set<Number> seen;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (seen.insert(members[i].*number).second) continue;
    std::string pointer = "/" + list;
    pointer.append("/").append(std::to_string(i)).append("/").append(key);
    return OptionFault{pointer, std::to_string(members[i].*number) + " is there already"};
  }
  return std::nullopt;
}

}  // namespace splid
