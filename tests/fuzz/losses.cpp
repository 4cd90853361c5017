#include "protocol/loss_collector.hpp"
#include "protocol/ptu_losses.hpp"
#include "protocol/text.hpp"
#include "tests/fuzz/fuzz.hpp"

// The losses of a recording's header: refused, or read, and then the same after they were written
// again; in less room they are joined, and none is forgotten.

namespace splid::test::fuzz_losses {
namespace {

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
  for (const Loss& loss : *losses) {
    must(std::any_of(joined->begin(), joined->end(),
                     [&](const Loss& wider) {
                       return wider.begin_ps <= loss.begin_ps && wider.end_ps >= loss.end_ps;
                     }),
         "intervals grow");
  }
}

}  // namespace
}  // namespace splid::test::fuzz_losses

SPLID_FUZZ_TARGET(losses) {
  splid::test::fuzz_losses::check(splid::test::as_text(data, size));
  return 0;
}
