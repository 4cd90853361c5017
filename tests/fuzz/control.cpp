#include "daemon/service/control/control_message.hpp"
#include "tests/fuzz/fuzz.hpp"

// A control request, and the same text as a reply: each refused in a sentence, or read, and then
// the same after it was written again.

namespace splid::test::fuzz_control {
namespace {

void check_request(const std::string& text) {
  control::Request request;
  if (!accepts(Fault::usage, [&] { request = control::request_from_json(text); })) return;
  const std::string written = to_json(request);
  must(to_json(control::request_from_json(written)) == written, "a request comes back");
  if (request.command != control::Command::calibrate) return;
  must(request.calibrate.seconds >= 0.1 && request.calibrate.seconds <= 600, "it ends");
}

void check_reply(const std::string& text) {
  control::Reply reply;
  if (!accepts(Fault::data, [&] { reply = control::reply_from_json(text); })) return;
  const std::string written = to_json(reply);
  must(written.find('\n') == std::string::npos, "a reply is one line");
  must(to_json(control::reply_from_json(written)) == written, "a reply comes back");
}

}  // namespace
}  // namespace splid::test::fuzz_control

SPLID_FUZZ_TARGET(control) {
  const std::string text = splid::test::as_text(data, size);
  splid::test::fuzz_control::check_request(text);
  splid::test::fuzz_control::check_reply(text);
  return 0;
}
