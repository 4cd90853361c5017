#include "protocol/nearest_name.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace splid {
namespace {

// The edit distance in which a swap of neighbours counts once (optimal string alignment).
//
// Design note: a swap is the commonest slip of typing ("pusle"). If it counted as two changes, a
// name that has nothing but its length in common could be nearer.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1);
  std::vector<std::size_t> above(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) above[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    std::swap(before, above);
    std::swap(above, row);
  }
  return above[b.size()];
}

}  // namespace

const char* nearest_name(std::string_view name, std::span<const char* const> names) {
  const char* nearest = nullptr;
  std::size_t fewest = 0;
  for (const char* candidate : names) {
    const std::size_t length = std::string_view(candidate).size();
    const std::size_t longest = std::max(name.size(), length);
    // Each character that one has more is an edit: a name of megabytes is not compared.
    if (2 * (longest - std::min(name.size(), length)) > longest) continue;
    const std::size_t count = edits(name, candidate);
    if (5 * count > 2 * longest || (nearest != nullptr && count >= fewest)) continue;
    nearest = candidate;
    fewest = count;
  }
  return nearest;
}

std::string suggest_name(std::string_view name, std::span<const char* const> names) {
  if (const char* nearest = nearest_name(name, names)) {
    return std::string("; did you mean ") + nearest + "?";
  }
  std::string all;
  for (const char* candidate : names)
    all += (all.empty() ? "; known are " : ", ") + std::string(candidate);
  return all;
}

}  // namespace splid
