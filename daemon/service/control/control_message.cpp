#include "daemon/service/control/control_message.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "config/json_text.hpp"
#include "config/option_reader.hpp"
#include "config/option_writer.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/shown_text.hpp"

namespace splid::control {
namespace {

constexpr const char* schema_name = "splid.control";
constexpr const char* place = "request";

constexpr std::array<const char*, 7> command_names = {
    "status", "start", "stop", "record_start", "record_stop", "upload", "calibrate"};

// Names of the faults, in the order of their exit codes from 2 on.
constexpr std::array<const char*, 3> fault_names = {"usage", "device", "data"};

[[noreturn]] void refuse(const std::string& what) {
  throw Error(Fault::usage, std::string(place) + ": " + what);
}

void read_header(OptionReader& reader) {
  reader.require("schema");
  const nlohmann::json* schema = reader.take("schema");
  if (schema != nullptr && *schema != schema_name) {
    refuse("/schema: " + shown(*schema) + " is not \"" + schema_name + "\"");
  }
  const nlohmann::json* version = reader.take("v");
  if (version == nullptr) return;
  const bool is_pair = version->is_array() && version->size() == 2 &&
                       (*version)[0].is_number_unsigned() && (*version)[1].is_number_unsigned();
  if (!is_pair || (*version)[0] != 1) {
    refuse("/v: " + shown(*version) + " is not [1, x], the version that this splid reads");
  }
}

const char* fault_name(Fault fault) {
  return fault_names.at(static_cast<std::size_t>(fault) - static_cast<std::size_t>(Fault::usage));
}

Fault fault_of(const std::string& name) {
  const auto found = std::find(fault_names.begin(), fault_names.end(), name);
  if (found == fault_names.end()) return Fault::data;
  return static_cast<Fault>(static_cast<int>(Fault::usage) + (found - fault_names.begin()));
}

}  // namespace

const char* to_string(Command command) {
  return command_names.at(static_cast<std::size_t>(command));
}

void CalibrateRequest::describe(OptionVisitor& visitor) {
  visitor.require("seconds");
  visitor.number("seconds", seconds, {0.1, 600}, "how long tags are taken from the source, s");
  visitor.number("distance_m", distance_m, {-1e6, 1e6}, "where the target is, m");
  visitor.number("time_ps", time_ps, {1e-3, 1e6}, "how well each pulse's time is to be known, ps");
  visitor.number("amplitude_percent", amplitude_percent, {1e-3, 100},
                 "how well each pulse's amplitude is to be known, percent of the mean pulse");
}

Request request_from_json(const std::string& text) {
  if (text.size() > max_request_bytes) {
    refuse(std::to_string(text.size()) + " bytes are more than the " +
           std::to_string(max_request_bytes) + " that one may have");
  }
  const nlohmann::json document = parse_json_text(text, place);
  OptionReader reader(document, place, "");
  read_header(reader);
  Request request;
  reader.require("request");
  choose(reader, "request", request.command, command_names, "what is asked");
  if (request.command == Command::calibrate) request.calibrate.describe(reader);
  reader.finish();
  return request;
}

std::string to_json(const Request& request) {
  nlohmann::ordered_json document;
  document["schema"] = schema_name;
  document["v"] = {1, 0};
  document["request"] = to_string(request.command);
  OptionWriter writer(document);
  CalibrateRequest calibrate =
      request.calibrate;  // a copy, since describe() takes a mutable object
  if (request.command == Command::calibrate) calibrate.describe(writer);
  return json_text(document);
}

std::string Reply::find(const std::string& name) const {
  for (const auto& [key, value] : more) {
    if (key == name) return value;
  }
  return {};
}

std::string to_json(const Reply& reply) {
  JsonWriter json;
  json.text("schema", schema_name).raw("v", "[1,0]");
  if (!reply.request.empty()) json.text("request", reply.request);
  json.flag("ok", !reply.fault);
  json.text(reply.fault ? "error" : "message", shown_lines(reply.message));
  if (reply.fault) json.text("fault", fault_name(*reply.fault));
  for (const auto& [key, value] : reply.more) json.raw(key, value);
  return json.finish();
}

Reply reply_from_json(const std::string& text) {
  const auto json = ordered_json_value_if_any(text);
  const auto text_of = [&json](const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_string() ? shown_lines(found->get<std::string>())
                                                     : std::string();
  };
  if (!json.is_object() || text_of("schema") != schema_name || !json.contains("ok")) {
    throw Error(Fault::data, "what answered is no splid: " + shown_text(text, 60));
  }
  Reply reply{text_of("request"), {}, text_of("message")};
  if (json["ok"] != true) {
    reply.fault = fault_of(text_of("fault"));
    reply.message = text_of("error");
  }
  constexpr std::array<const char*, 7> common = {"schema", "v",       "request", "ok",
                                                 "error",  "message", "fault"};
  for (const auto& [key, value] : json.items()) {
    const std::string& name = key;
    const bool is_common = std::any_of(common.begin(), common.end(),
                                       [&name](const char* each) { return name == each; });
    if (!is_common) reply.more.emplace_back(name, json_text(value));
  }
  return reply;
}

}  // namespace splid::control
