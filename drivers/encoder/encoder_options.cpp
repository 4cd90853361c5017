#include "drivers/encoder/encoder_options.hpp"

#include "drivers/client_socket.hpp"

namespace splid {

void EncoderOptions::describe(OptionVisitor& visitor) {
  visitor.path("file", file, "counts from a file: lines of FIRST_INDEX,COUNT[,COUNT...]");
  visitor.text("address", address,
               "counts from a bridge that sends such lines: unix:PATH or tcp:HOST:PORT");
  visitor.number("m_per_count", m_per_count, {-1e3, 1e3},
                 "metres a count; negative where counts fall as the target goes away");
  visitor.number("offset_m", offset_m, {-1e9, 1e9}, "distance at count 0, m");
}

std::optional<OptionFault> EncoderOptions::validate() const {
  if (m_per_count == 0) return OptionFault{"/m_per_count", "0 makes every count the same place"};
  if (address.empty()) return std::nullopt;
  if (!file.empty()) return OptionFault{"/address", "the counts already come from /encoder/file"};
  const std::optional<std::string> fault = socket_address_fault(address);
  if (!fault) return std::nullopt;
  return OptionFault{"/address", "\"" + address + "\" " + *fault};
}

}  // namespace splid
