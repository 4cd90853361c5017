#include "config/bridge_config.hpp"

#include "config/json_text.hpp"
#include "config/option_reader.hpp"
#include "config/read_file.hpp"
#include "drivers/client_socket.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr int bridge_major_version = 1;

}  // namespace

std::string load_bridge_config(const std::string& file, const std::string& maker,
                               SourceOptions& options) {
  const nlohmann::json document = parse_json_text(read_file(file), file);
  OptionReader reader(document, file, "");
  reader.need("schema", "add \"schema\":\"splid.bridge.NAME\", with the bridge's name");
  read_header(reader, file, "splid.bridge." + maker, bridge_major_version);
  std::string listen;
  reader.text("listen", listen,
              "where splid finds the bridge: unix:PATH or tcp:HOST:PORT, as source.address");
  reader.require("listen");
  options.describe(reader);
  reader.finish();
  const auto refuse = [&file](const std::string& what) {
    throw Error(Fault::usage, file + ": " + what);
  };
  if (const auto fault = socket_address_fault(listen)) {
    refuse("/listen: \"" + listen + "\" " + *fault);
  }
  if (const auto fault = options.validate()) refuse(fault->pointer + ": " + fault->what);
  return listen;
}

}  // namespace splid
