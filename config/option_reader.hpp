#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "protocol/options.hpp"

namespace splid {

// A visitor that fills options from a JSON object and checks each key: its type, its bounds, and
// that it is known. Relative paths become relative to the file's folder.
//
// Errors: each call throws Error(Fault::usage) naming file, JSON pointer, value and bound; finish()
// throws it also for keys that no call asked for.
class OptionReader final : public OptionVisitor {
 public:
  // object: outlives the reader; it is an error if it is no JSON object. pointer: the object's own.
  OptionReader(const nlohmann::json& object, std::string file, std::string pointer);

  void number(const char* key, double& value, Bounds bounds, const char* doc) override;
  void number(const char* key, std::optional<double>& value, Bounds bounds,
              const char* doc) override;
  void integer(const char* key, std::int64_t& value, std::int64_t min, std::int64_t max,
               const char* doc) override;
  void flag(const char* key, bool& value, const char* doc) override;
  void text(const char* key, std::string& value, const char* doc) override;
  void path(const char* key, std::string& value, const char* doc) override;
  void choice(const char* key, std::size_t& index, std::span<const char* const> names,
              const char* doc) override;
  void numbers(const char* key, std::vector<double>& values, Bounds bounds,
               const char* doc) override;
  void pairs(const char* key, std::vector<NumberPair>& values, const std::array<Bounds, 2>& bounds,
             const char* doc) override;
  void channel(const char* key, std::string& value, const char* doc) override;
  void channels(const char* key, std::vector<std::string>& values, const char* doc) override;
  void object(const char* key, const std::function<void(OptionVisitor&)>& members,
              const char* doc) override;
  void objects(const char* key, const std::function<void(std::size_t)>& resize,
               const std::function<void(OptionVisitor&, std::size_t)>& member, std::size_t count,
               const char* doc) override;
  void require(const char* key) override;

  // The member's value, null where it is not given. The key, a literal, counts as known from then
  // on.
  const nlohmann::json* take(const char* key);
  // require() with the sentence of what to do about it, a literal.
  void need(const char* key, const char* advice);
  // Must be called when all keys were described.
  void finish() const;

 private:
  [[nodiscard]] std::vector<std::string> unknown_keys() const;
  double read_number(const nlohmann::json& value, const std::string& pointer, Bounds bounds) const;
  std::string read_channel(const nlohmann::json& value, const std::string& pointer) const;
  [[noreturn]] void fail(const std::string& pointer, const std::string& what) const;

  const nlohmann::json& object_;
  std::string file_;
  std::string pointer_;
  std::vector<const char*> known_;                            // literals
  std::vector<std::pair<const char*, const char*>> missing_;  // literals: a key, and what to do
};

// Reads the members "schema" and "v" that a configuration begins with; either may be absent.
//
// Errors: Error(Fault::usage) where the first is not `schema`, or the second another major version.
void read_header(OptionReader& reader, const std::string& file, const std::string& schema,
                 int major_version);

}  // namespace splid
