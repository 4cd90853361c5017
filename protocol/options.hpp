#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace splid {

struct Bounds {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

using NumberPair = std::array<double, 2>;

// How a struct of options shows its keys to whoever fills, prints or documents them. Each struct
// has one `describe(OptionVisitor&)`, which names every key once with its bounds and a sentence
// with the unit; the JSON reader, the schema and the dump of the effective configuration are all
// visitors, so a key cannot be read and yet be missing from the schema. The value passed in is the
// default: a reader leaves it as it is where the key is not given.
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;

  virtual void number(const char* key, double& value, Bounds bounds, const char* doc) = 0;
  virtual void number(const char* key, std::optional<double>& value, Bounds bounds,
                      const char* doc) = 0;
  virtual void integer(const char* key, std::int64_t& value, std::int64_t min, std::int64_t max,
                       const char* doc) = 0;
  virtual void flag(const char* key, bool& value, const char* doc) = 0;
  virtual void text(const char* key, std::string& value, const char* doc) = 0;
  // A file. A relative path is relative to the file that names it, and a reader resolves it.
  virtual void path(const char* key, std::string& value, const char* doc) = 0;
  // index: into names
  virtual void choice(const char* key, std::size_t& index, std::span<const char* const> names,
                      const char* doc) = 0;
  virtual void numbers(const char* key, std::vector<double>& values, Bounds bounds,
                       const char* doc) = 0;
  // An array of pairs of numbers, such as the rows of a short table.
  virtual void pairs(const char* key, std::vector<NumberPair>& values,
                     const std::array<Bounds, 2>& bounds, const char* doc) = 0;
  // A channel name: `sync`, `marker:N`, or an input number; empty for none.
  virtual void channel(const char* key, std::string& value, const char* doc) {
    text(key, value, doc);
  }
  // An array of channel names or a single one.
  virtual void channels(const char* key, std::vector<std::string>& values, const char* doc) = 0;
  virtual void object(const char* key, const std::function<void(OptionVisitor&)>& members,
                      const char* doc) = 0;
  // An array of objects; `member(visitor, i)` is called for each i after resize(n).
  virtual void objects(const char* key, const std::function<void(std::size_t)>& resize,
                       const std::function<void(OptionVisitor&, std::size_t)>& member,
                       std::size_t count, const char* doc) = 0;
  // The key of the object that is being visited must be given. May be called before or after the
  // key itself is visited.
  virtual void require(const char* key) = 0;
};

// choice() for an enum whose enumerators count from 0 in the order of `names`.
template <class Enum>
void choose(OptionVisitor& visitor, const char* key, Enum& value,
            std::span<const char* const> names, const char* doc) {
  const auto before = static_cast<std::size_t>(value);
  std::size_t index = before;
  visitor.choice(key, index, names, doc);
  // A visitor that only prints the options changes nothing. The value is then not even assigned to
  // itself, since other threads may be reading it.
  if (index != before) value = static_cast<Enum>(index);
}

// What a cross-check of several options found wrong.
struct OptionFault {
  std::string pointer;  // JSON pointer relative to the struct, such as /length_ms
  std::string what;     // value and bound, in a sentence
};

}  // namespace splid
