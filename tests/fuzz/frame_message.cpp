#include "protocol/frame_json.hpp"
#include "tests/fuzz/fuzz.hpp"

// A frame message: refused in a sentence, or read, and then the same after it was written again.

SPLID_FUZZ_TARGET(frame_message) {
  using namespace splid;
  using namespace splid::test;
  FrameMessage message;
  const std::string text = as_text(data, size);
  if (!accepts(Fault::data, [&] { message = frame_from_json(text); })) return 0;
  const std::string written = to_json(message);
  must(written.find('\n') == std::string::npos, "a message is one line");
  must(to_json(frame_from_json(written)) == written, "a message comes back from its JSON");
  return 0;
}
