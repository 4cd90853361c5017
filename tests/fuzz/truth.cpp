#include "protocol/truth.hpp"

#include "tests/fuzz/fuzz.hpp"

// A truth file: refused in a sentence, or read, and then the same after it was written again.

SPLID_FUZZ_TARGET(truth) {
  using namespace splid;
  using namespace splid::test;
  SceneTruth truth;
  const std::string text = as_text(data, size);
  if (!accepts(Fault::data, [&] { truth = truth_from_json(text); })) return 0;
  must(truth_from_json(to_json(truth)) == truth, "a truth comes back from its file");
  must(truth.at(truth.start_ps).has_value(), "there is a sample at the start");
  for (const std::int64_t time_ps :
       {INT64_MIN, std::int64_t{0}, truth.start_ps + 1, truth.step_ps, INT64_MAX}) {
    const auto state = truth.at(time_ps);
    must(!state || time_ps >= truth.start_ps, "nothing is known before the start");
  }
  return 0;
}
