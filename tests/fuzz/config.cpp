#include "config/config.hpp"

#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/fuzz_pattern.hpp"

// A configuration with a pattern beside it, no file being opened: refused in a sentence that names
// the file, or read, and then the same after its effective form was read again.

SPLID_FUZZ_TARGET(config) {
  using namespace splid;
  using namespace splid::test;
  static const std::string pattern = fuzz_pattern_json();
  const ReadText read = [](const std::string&, const std::string&) { return pattern; };
  const std::string text = as_text(data, size);
  Config config;
  if (!accepts(Fault::usage, [&] { config = config_from_json(text, "/f/c.json", read); })) return 0;
  must(config.source != nullptr, "a configuration has a source");
  const std::string effective = config_to_json(config);
  must(config_to_json(config_from_json(effective, "/f/c.json", read)) == effective,
       "an effective configuration reads as itself");
  return 0;
}
