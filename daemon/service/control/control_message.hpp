#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/options.hpp"

namespace splid::control {

// The room daemon/service/control is the way for `splid ctl` into a running daemon: the messages,
// which are in this header, the endpoint (control_endpoint.hpp), the server (control_server.hpp)
// and the client (control_client.hpp). Read this header first.

// What can be asked of a running daemon; docs/reference/control.md has each request on the wire.
enum class Command { status, start, stop, record_start, record_stop, upload, calibrate };

const char* to_string(Command command);

// How the pattern is to be calibrated from the source itself.
struct CalibrateRequest {
  double seconds = 0;                // of the source's tags
  std::optional<double> distance_m;  // of the target, at rest; absent: distances will be relative
  double time_ps = 5;                // wanted standard deviation of each pulse's time
  double amplitude_percent = 2;  // wanted standard deviation of each amplitude, of the mean pulse
  void describe(OptionVisitor& visitor);
};

struct Request {
  Command command = Command::status;
  CalibrateRequest calibrate;  // used where the command is calibrate
};

// Bytes of the longest request that is accepted.
inline constexpr std::size_t max_request_bytes = 4096;

// Reads a request. Errors: Error(Fault::usage) with a sentence that names the member, its value and
// the bound, for every text that is no request: too long, no JSON, another schema or version, an
// unknown command or key (with the nearest known name), a key given twice, a value out of its
// bounds.
Request request_from_json(const std::string& text);

std::string to_json(const Request& request);

// What came of a request.
struct Reply {
  std::string request;         // the command's name; empty where the request could not be read
  std::optional<Fault> fault;  // absent: the request was carried out
  std::string message;         // a sentence: what was done, or why nothing was
  // Further members in their order, each a name and a JSON value.
  std::vector<std::pair<std::string, std::string>> more = {};

  // The JSON value of the member of `more` with that name; empty where there is none.
  [[nodiscard]] std::string find(const std::string& name) const;
};

std::string to_json(const Reply& reply);

// Errors: Error(Fault::data) where the text is no reply.
Reply reply_from_json(const std::string& text);

}  // namespace splid::control
