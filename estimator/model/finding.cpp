#include "estimator/model/finding.hpp"

#include <algorithm>

namespace splid {

bool FoundList::has(FindingName name) const {
  const auto found = all();
  return std::any_of(found.begin(), found.end(), [&](const auto& f) { return f.name == name; });
}

void FoundList::add(const Finding& finding) {
  if (!has(finding.name)) found_.at(count_++) = finding;
}

}  // namespace splid
