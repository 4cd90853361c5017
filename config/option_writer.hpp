#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocol/options.hpp"

namespace splid {

// Writes options into a JSON object that an OptionReader reads back to the same values, in the
// order of their descriptions. An option without a value (an absent number, an empty path) is left
// out.
class OptionWriter final : public OptionVisitor {
 public:
  // object: is written to, and outlives the writer.
  explicit OptionWriter(nlohmann::ordered_json& object) : object_(object) {}

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

 private:
  nlohmann::ordered_json& object_;
};

}  // namespace splid
