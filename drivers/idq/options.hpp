#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/message_socket.hpp"
#include "drivers/source.hpp"

namespace splid::idq {

enum class Edge : std::uint8_t { falling, rising };
enum class Reference : std::uint8_t { internal, external_10_mhz };

struct InputOptions {
  std::int64_t input = 1;  // as on the panel
  std::int64_t level_mv = 100;
  Edge edge = Edge::rising;
  std::int64_t delay_ps = 0;  // added to the times
};

// A Time Controller of ID Quantique's, the maker's data link program that takes its data, and how
// the inputs are set. JSON: the configuration of `splid bridge idq`.
struct Options : SourceOptions {
  std::string address;                           // of the instrument: tcp:HOST:PORT
  std::string data_link = "tcp:127.0.0.1:6060";  // of the program
  std::int64_t stream_port = 4241;               // input n comes on port stream_port + n
  Reference reference = Reference::internal;
  std::int64_t sub_acquisition_ms = 200;
  std::vector<InputOptions> inputs = {InputOptions{}};
  OpenSocket open_socket;  // no key: to be set before open()

  // Of a sub-acquisition, and from the begin of one to the begin of the next.
  [[nodiscard]] std::int64_t width_ps() const;
  [[nodiscard]] std::int64_t period_ps() const;

  void describe(OptionVisitor& visitor) override;
  [[nodiscard]] std::optional<OptionFault> validate() const override;
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
};

}  // namespace splid::idq
