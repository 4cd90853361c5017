#include "config/former_values.hpp"

namespace splid {
namespace {

struct FormerValue {
  const char* pointer;
  const char* value;
  const char* taken;
  const char* why;
};

constexpr FormerValue former_values[] = {
    {"/estimator/effort", "exhaustive", "balanced",
     "it took twice the time to find less than one target in a hundred more"},
};

}  // namespace

std::vector<std::string> replace_former_values(nlohmann::json& document, const std::string& file) {
  std::vector<std::string> notes;
  for (const FormerValue& former : former_values) {
    const nlohmann::json::json_pointer pointer(former.pointer);
    if (!document.contains(pointer) || document[pointer] != former.value) continue;
    document[pointer] = former.taken;
    notes.push_back(file + ": " + former.pointer + ": \"" + former.value +
                    "\" is no longer there, since " + former.why + "; \"" + former.taken +
                    "\" is taken for it");
  }
  return notes;
}

}  // namespace splid
