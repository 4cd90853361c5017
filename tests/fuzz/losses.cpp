#include "protocol/loss_collector.hpp"
#include "protocol/ptu_losses.hpp"
#include "protocol/text.hpp"
#include "tests/fuzz/fuzz.hpp"

// The losses of a recording's header: refused, or read, and then the same after they were written
// again; in less room they are joined, and cover no more time than before.

namespace splid::test::fuzz_losses {
namespace {

long double length_ps(const std::vector<Loss>& losses) {
  long double sum_ps = 0;
  for (const Loss& loss : losses) sum_ps += static_cast<long double>(loss.end_ps) - loss.begin_ps;
  return sum_ps;
}

void check(const std::string& text) {
  (void)whole_number(text);
  auto losses = losses_from_text(text);
  if (!losses) return;
  must(losses_from_text(losses_to_text(*losses, SIZE_MAX)) == losses, "losses come back");
  std::sort(losses->begin(), losses->end(),
            [](const Loss& a, const Loss& b) { return a.begin_ps < b.begin_ps; });
  const std::string shorter = losses_to_text(*losses, 64);
  must(shorter.size() <= 64, "losses fit into the room given");
  const auto joined = losses_from_text(shorter);
  must(joined.has_value(), "what is joined can be read");
  must(length_ps(*joined) <= length_ps(*losses), "joined losses cover no time that was seen");
}

}  // namespace
}  // namespace splid::test::fuzz_losses

SPLID_FUZZ_TARGET(losses) {
  splid::test::fuzz_losses::check(splid::test::as_text(data, size));
  return 0;
}
