#include <cmath>

#include "protocol/pattern_json.hpp"
#include "tests/fuzz/fuzz.hpp"

// A pattern file: refused in a sentence, or read, and then the same after it was written again.

SPLID_FUZZ_TARGET(pattern) {
  using namespace splid;
  using namespace splid::test;
  Pattern pattern;
  const std::string text = as_text(data, size);
  if (!accepts(Fault::data, [&] { pattern = pattern_from_json(text, "pattern"); })) return 0;
  must(!validate(pattern), "a pattern that is read is valid");
  must(pattern_from_json(to_json(pattern), "again") == pattern, "a pattern comes back from a line");
  must(pattern_from_json(to_json_file(pattern), "again") == pattern,
       "a pattern comes back from a file");
  const double period_ps = pattern_period_ps(pattern);
  must(period_ps > 0 && period_ps <= 1e12, "a period is above 0 and at most a second");
  must(pulses_per_period(pattern) > 0, "a period has a pulse");
  return 0;
}
