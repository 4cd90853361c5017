#include <cmath>

#include "drivers/awg/scpi_reply.hpp"
#include "tests/fuzz/fuzz.hpp"

// Any answer of an instrument: a value of the form that was asked for, or none.

SPLID_FUZZ_TARGET(scpi) {
  using namespace splid;
  using namespace splid::test;
  const std::string line = as_text(data, size);
  (void)awg::parse_scpi_identity(line);
  (void)awg::parse_scpi_error(line);
  const auto number = awg::parse_scpi_number(line);
  must(!number || std::isfinite(*number), "a number is finite");
  const auto integers = awg::parse_scpi_integers(line);
  must(!integers || !integers->empty(), "a list has a number");
  if (const auto head = awg::parse_scpi_block_head(line)) {
    must(head->head_bytes >= 3 && head->head_bytes <= size, "a block's head is what stands there");
    must(head->content_bytes <= 999'999'999, "a block's length has nine digits");
    const auto again = awg::parse_scpi_block_head(awg::scpi_block_head(head->content_bytes));
    must(again && again->content_bytes == head->content_bytes, "a head comes back");
  }
  const std::string shown = awg::shown_scpi(line);
  must(shown.size() <= 64, "what is shown is short");
  for (const char c : shown) must(c >= ' ' && c <= '~', "what is shown is printable");
  return 0;
}
