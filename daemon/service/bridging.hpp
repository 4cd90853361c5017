#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/source.hpp"

namespace splid {

// An instrument that a bridge reads.
struct BridgedInstrument {
  std::unique_ptr<TagSource> source;
  // The call into the maker's library that hangs; empty where none does. From any thread.
  std::function<std::string()> overdue_call;
};

using OpenBridged = std::function<BridgedInstrument(const SourceContext& context)>;

// The life of a bridge, a process of its own: serves the instrument's tags at `listen` until SIGINT
// or SIGTERM, says in the log and to the service manager how the instrument does, and feeds the
// watchdog. A call into the library that hangs ends the process at once with exit code 3, since
// nothing else ends such a call; the service manager starts it again.
//
// Returns the exit code. Errors: Error where it cannot listen there.
int run_bridge(const std::string& listen, const OpenBridged& open);

}  // namespace splid
