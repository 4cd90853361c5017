#pragma once

#include <cctype>
#include <nlohmann/json.hpp>
#include <string>

#include "config/key_unit.hpp"
#include "protocol/json_value.hpp"

namespace splid::test {

// Writes a configuration's JSON schema as Markdown: a heading and a table for each section, a row
// for each key.
class SchemaTable {
 public:
  using Json = nlohmann::ordered_json;

  static std::string of(const Json& schema) {
    SchemaTable table;
    table.heading("the file itself", schema);
    for (const auto& [key, member] : schema["properties"].items()) {
      if (!member.contains("properties") && !member.contains("oneOf") && !is_list_or_file(member)) {
        table.row(key, member, schema);
      }
    }
    table.text_ += "\n";
    for (const auto& [key, member] : schema["properties"].items()) table.section(key, member);
    return table.text_;
  }

 private:
  void section(const std::string& key, const Json& member) {
    if (member.contains("oneOf")) {
      for (const Json& kind : member["oneOf"]) {
        const std::string driver = kind["properties"]["driver"]["const"];
        heading("`" + key + "`, driver `" + driver + "`", member);
        rows("", kind);
      }
    } else if (member.contains("properties")) {
      heading("`" + key + "`", member);
      rows("", member);
    } else if (is_list_or_file(member)) {
      heading("`" + key + "`", member);
      rows("", member["anyOf"][0]["items"]);
    }
  }

  // A list of objects, or the name of a file that holds the list.
  static bool is_list_or_file(const Json& member) {
    return member.contains("anyOf") && member["anyOf"][0].contains("items") &&
           member["anyOf"][0]["items"].contains("properties");
  }

  void heading(const std::string& name, const Json& schema) {
    text_ += "### " + name + "\n\n";
    if (schema.contains("description")) text_ += sentence(schema["description"]) + "\n\n";
    text_ += "| key | default | allowed | unit | meaning |\n|---|---|---|---|---|\n";
  }

  void rows(const std::string& prefix, const Json& object) {
    for (const auto& [key, member] : object["properties"].items()) {
      row(prefix + key, member, object);
      if (member.contains("properties")) rows(prefix + key + "/", member);
      if (member.contains("items") && member["items"].contains("properties")) {
        rows(prefix + key + "/N/", member["items"]);
      }
    }
    if (prefix.empty()) text_ += "\n";
  }

  void row(const std::string& path, const Json& member, const Json& object) {
    const std::string key = path.substr(path.rfind('/') + 1);
    bool is_required = false;
    for (const Json& name : object["required"]) is_required = is_required || name == key;
    std::string preset = is_required ? "required" : "none";
    if (!is_required && member.contains("default")) preset = code(json_text(member["default"]));
    if (member.contains("properties")) preset = "";
    text_ += "| " + code(path) + " | " + preset + " | " + allowed(member) + " | " +
             std::string(unit_of_key(key)) + " | " + member.value("description", "") + " |\n";
  }

  static std::string allowed(const Json& member) {
    if (member.contains("const")) return code(json_text(member["const"]));
    if (member.contains("enum")) return listed(member["enum"]);
    if (member.contains("prefixItems")) return "`[1,N]`";
    if (member.contains("anyOf")) {
      return member["anyOf"].size() == 3 ? "a channel, or an array of them" : "a channel";
    }
    const std::string type = member.value("type", "");
    if (type == "array" && member["items"].contains("prefixItems")) {
      const Json& pair = member["items"]["prefixItems"];
      return "array of pairs: " + allowed(pair[0]) + ", " + allowed(pair[1]);
    }
    if (type == "array") {
      return member["items"].contains("properties") ? "array of objects"
                                                    : "array of " + allowed(member["items"]);
    }
    const std::string least = member.contains("minimum") ? json_text(member["minimum"]) : "";
    const std::string most = member.contains("maximum") ? json_text(member["maximum"]) : "";
    if (!least.empty() && !most.empty()) {
      return least + " to " + most + (type == "integer" ? ", whole" : "");
    }
    if (member.value("format", "") == "path") return "path of a file";
    return type == "boolean" ? "`true`, `false`" : type;
  }

  static std::string listed(const Json& names) {
    std::string list;
    for (const Json& name : names) list += (list.empty() ? "" : ", ") + code(json_text(name));
    return list;
  }

  static std::string code(const std::string& text) { return "`" + text + "`"; }

  static std::string sentence(std::string text) {
    text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    text += ".";
    // Prose has lines of at most 120 columns.
    for (std::size_t line = 0; text.size() - line > 120;) {
      line = text.rfind(' ', line + 120);
      text[line++] = '\n';
    }
    return text;
  }

  std::string text_;
};

}  // namespace splid::test
