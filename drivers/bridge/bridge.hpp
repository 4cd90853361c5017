#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/client_socket.hpp"
#include "drivers/source.hpp"
#include "drivers/tags16_stream.hpp"

namespace splid {

// An instrument behind a bridge: a program that reads it through its vendor's library and serves
// tags16 blocks (docs/reference/tags16.md). JSON: `source` with the driver "bridge".
struct BridgeOptions : SourceOptions {
  std::string address;  // "unix:PATH" or "tcp:HOST:PORT"

  void describe(OptionVisitor& visitor) override;
  [[nodiscard]] std::optional<OptionFault> validate() const override;
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
};

// The tags of a bridge. It connects as a client, and anew for ever when the bridge is not there or
// goes away: at once, after 0.1 s, then twice as long each time up to 2 s. What a pause may have
// cost is a loss in the stream, from where it was to the first block after it, or a clock_break
// where the bridge's clock began anew.
//
// Reports no_device while there is no connection, with the reason; connected at the first block,
// and with what was lost where blocks are missing or damaged; failing when no whole block came for
// a second. A connection silent for 3 s is given up and made anew, since a machine that lost its
// power closes none.
//
// Threads, timeouts: as TagSource. Errors: none from run(); the constructor's as ClientSocket's.
class BridgeSource : public TagSource {
 public:
  BridgeSource(const BridgeOptions& options, SourceContext context);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;
  [[nodiscard]] std::vector<SourceCounter> counters() const override;

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  void connect(TagSink& sink, const std::stop_token& stop);
  void read(TagSink& sink);
  void watch_blocks();
  void report(DeviceState state, const std::string& reason);

  SourceContext context_;
  ClientSocket socket_;
  Tags16Stream stream_;
  Tags16News news_;
  std::vector<std::byte> buffer_;
  std::chrono::milliseconds pause_{0};  // before the next attempt to connect
  SteadyTime heard_;                    // last byte, or the connection's start
  SteadyTime block_seen_;               // last whole block, likewise
  std::uint64_t blocks_ = 0;            // at block_seen_
  std::optional<DeviceReport> report_;  // the last
  std::atomic<std::uint64_t> connections_{0};
};

}  // namespace splid
