#pragma once

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

// The tags of a bridge. The source connects as a client. While the bridge is not there it tries
// again for ever: at once where the connection lasted for a second, after 0.1 s, then after twice
// the pause before, up to 2 s. Tags that a pause may have cost are a loss in the stream, from where
// the stream was to the first block after the pause, or a clock_break where the bridge's clock
// began anew.
//
// It reports no_device, with the reason, while there is no connection; connected at the first
// block, and whenever blocks are missing or damaged, with what was lost; failing when no whole
// block came for a second. The bridge's notices of its instrument become reports of the same kind.
// A connection that is silent for 3 s is given up and made anew, since a machine that lost its
// power does not close its connections.
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
  void heed_bridge();
  void tell(const std::string& event);
  void report(const DeviceReport& report);

  SourceContext context_;
  ClientSocket socket_;
  Tags16Counters counters_;
  Tags16Stream stream_{counters_};
  Tags16News news_;
  std::vector<std::byte> buffer_;
  std::chrono::milliseconds pause_{0};  // before the next attempt to connect
  SteadyTime connected_;                // the start of the connection
  SteadyTime heard_;                    // time of the last byte, or of the connection's start
  SteadyTime block_seen_;               // time of the last whole block, or of the start
  std::uint64_t blocks_ = 0;            // whole blocks at the time block_seen_
  std::uint64_t notices_ = 0;           // sentences on a state that were heeded
  std::uint64_t events_ = 0;            // events that were reported
  DeviceReport instrument_;             // what the bridge says that holds
  std::optional<DeviceReport> report_;  // the last report that was made
  std::atomic<std::uint64_t> connections_{0};
};

}  // namespace splid
