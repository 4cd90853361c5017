#include "drivers/idq/options.hpp"

#include <array>

#include "drivers/client_socket.hpp"
#include "drivers/idq/source.hpp"
#include "drivers/repeated_option.hpp"

namespace splid::idq {
namespace {

constexpr std::array<const char*, 2> edge_names = {"falling", "rising"};
constexpr std::array<const char*, 2> reference_names = {"internal", "external_10_mhz"};
constexpr std::int64_t most_inputs = 4;
constexpr std::int64_t most_level_mv = 2000;
constexpr std::int64_t most_delay_ps = 4'000'000;  // the instrument promises no more
constexpr std::int64_t most_port = 65'535 - most_inputs;

// Design note: the instrument takes 200 ms or more. In a second an input has 25 M times at most,
// so that a sub-acquisition always fits the data link program's buffer of 100 M and is one message.
constexpr std::int64_t least_sub_acquisition_ms = 200;
constexpr std::int64_t most_sub_acquisition_ms = 1000;

constexpr std::int64_t ps_a_ms = 1'000'000'000;
constexpr std::int64_t dead_time_ps = 40'000;  // the least between two sub-acquisitions

std::optional<OptionFault> address_fault(const char* pointer, const std::string& address) {
  if (const auto fault = socket_address_fault(address)) {
    return OptionFault{pointer, "\"" + address + "\" " + *fault};
  }
  if (address.starts_with("tcp:")) return std::nullopt;
  return OptionFault{pointer, "\"" + address + "\" must begin with tcp:"};
}

}  // namespace

std::int64_t Options::width_ps() const { return sub_acquisition_ms * ps_a_ms; }

std::int64_t Options::period_ps() const { return width_ps() + dead_time_ps; }

void Options::describe(OptionVisitor& visitor) {
  visitor.require("address");
  visitor.text("address", address, "the instrument's, tcp:HOST:PORT; its port is 5555");
  visitor.text("data_link", data_link, "of the maker's data link program, tcp:HOST:PORT");
  visitor.integer("stream_port", stream_port, 1024, most_port,
                  "the data link program hands out input N on this port plus N");
  choose(visitor, "reference", reference, reference_names, "the instrument's clock");
  visitor.integer("sub_acquisition_ms", sub_acquisition_ms, least_sub_acquisition_ms,
                  most_sub_acquisition_ms, "the instrument hands out the times of so long at once");
  visitor.objects(
      "inputs", [this](std::size_t count) { inputs.resize(count); },
      [this](OptionVisitor& member, std::size_t i) {
        InputOptions& input = inputs.at(i);
        member.require("input");
        member.integer("input", input.input, 1, most_inputs, "number on the panel");
        member.integer("level_mv", input.level_mv, -most_level_mv, most_level_mv,
                       "threshold at the connector, mV; negative for negative pulses");
        choose(member, "edge", input.edge, edge_names, "the edge that counts");
        member.integer("delay_ps", input.delay_ps, 0, most_delay_ps,
                       "added to the times, ps, as a cable would");
      },
      inputs.size(), "the inputs that are on, that of the syncs too");
}

std::optional<OptionFault> Options::validate() const {
  if (auto fault = address_fault("/address", address)) return fault;
  if (auto fault = address_fault("/data_link", data_link)) return fault;
  if (inputs.empty()) return OptionFault{"/inputs", "is empty: name an input"};
  return repeated_option(inputs, &InputOptions::input, "inputs", "input");
}

std::unique_ptr<TagSource> Options::open(const SourceContext& context) const {
  return std::make_unique<Source>(*this, context);
}

}  // namespace splid::idq
