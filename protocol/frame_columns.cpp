#include "protocol/frame_columns.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include "protocol/frame_members.hpp"
#include "protocol/json_writer.hpp"

namespace splid {
namespace {

constexpr std::size_t name_bytes = 16;
constexpr std::size_t pixel_bytes = 32;  // the longest name of a pixel
constexpr std::size_t list_bytes = 160;  // room for all names of findings

// Lays a message out as a row: shows its members as columns, in the order of the columns.
class FrameRow {
 public:
  virtual ~FrameRow() = default;

  void number(const Member& member, std::optional<double> value) {
    show_number(member, is_there_ ? value : std::nullopt);
  }
  void count(const Member& member, std::optional<std::uint64_t> value) {
    const bool known = is_there_ && value;
    show_integer(member, known ? std::optional(static_cast<std::int64_t>(*value)) : std::nullopt);
  }
  void count_if_any(const Member& member, std::uint64_t value) { count(member, value); }
  void whole(const Member& member, std::int64_t value) { show_integer(member, value); }
  void flag(const Member& member, bool value) { show_flag(member, value); }
  template <class Enum>
  void choice(const Member& member, Enum value) {
    show_text(member, name_bytes, to_string(value));
  }
  void text(const Member& member, const std::optional<std::string>& value) {
    show_text(member, name_bytes, value ? *value : "");
  }
  void text_if_any(const Member& member, const std::string& value) {
    show_text(member, pixel_bytes, value);
  }
  template <class Owner, class Members>
  void group(const Member& member, const Owner& owner, Members members) {
    group_ = member.name;
    members(owner, *this);
    group_ = {};
  }
  template <class Part, class Members>
  void part(const Member& member, const std::optional<Part>& part, Members members) {
    is_there_ = part.has_value();
    group(member, part ? *part : Part{}, members);
    is_there_ = true;
  }
  // The targets have no column: they are no values of a row.
  template <class Items, class Members>
  void list(const Member& /*member*/, const Items& /*items*/, const Members& /*members*/) {}
  // The names of findings.
  template <class Item, class Members>
  void list_if_any(const Member& member, const std::vector<Item>& items,
                   const Members& /*members*/) {
    std::string names;
    for (const Item& item : items) names += (names.empty() ? "" : ";") + item.name;
    show_text(member, list_bytes, names);
  }

 protected:
  virtual void show_number(const Member& member, std::optional<double> value) = 0;
  virtual void show_integer(const Member& member, std::optional<std::int64_t> value) = 0;
  virtual void show_flag(const Member& member, bool value) = 0;
  // bytes: room for the longest text.
  virtual void show_text(const Member& member, std::size_t bytes, std::string_view value) = 0;
  // The name of the column of a member that is shown: std_distance_m for distance_m in std.
  [[nodiscard]] std::string column_name(const Member& member) const {
    return group_.empty() ? member.name : std::string(group_) + "_" + member.name;
  }

 private:
  std::string_view group_;
  bool is_there_ = true;
};

class Describer final : public FrameRow {
 public:
  std::vector<FrameColumn> columns;

 private:
  void show_number(const Member& member, std::optional<double> /*value*/) override {
    add(member, ColumnType::number, sizeof(double));
  }
  void show_integer(const Member& member, std::optional<std::int64_t> /*value*/) override {
    add(member, ColumnType::integer, sizeof(std::int64_t));
  }
  void show_flag(const Member& member, bool /*value*/) override {
    add(member, ColumnType::flag, 1);
  }
  void show_text(const Member& member, std::size_t bytes, std::string_view /*value*/) override {
    add(member, ColumnType::text, bytes);
  }
  void add(const Member& member, ColumnType type, std::size_t bytes) {
    const std::size_t offset = columns.empty() ? 0 : columns.back().offset + columns.back().bytes;
    columns.push_back({column_name(member), member.unit, type, offset, bytes});
  }
};

class RowWriter final : public FrameRow {
 public:
  explicit RowWriter(std::string& rows) : rows_(rows) {}

 private:
  void show_number(const Member& /*member*/, std::optional<double> value) override {
    const bool known = value && std::isfinite(*value);
    put(known ? *value : std::numeric_limits<double>::quiet_NaN());
  }
  void show_integer(const Member& /*member*/, std::optional<std::int64_t> value) override {
    put(value.value_or(-1));
  }
  void show_flag(const Member& /*member*/, bool value) override { rows_ += value ? '\1' : '\0'; }
  void show_text(const Member& /*member*/, std::size_t bytes, std::string_view value) override {
    value = value.substr(0, bytes);
    rows_.append(value).append(bytes - value.size(), '\0');
  }
  template <class Value>
  void put(Value value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    rows_.append(bytes, sizeof value);
  }
  std::string& rows_;
};

class CsvWriter final : public FrameRow {
 public:
  [[nodiscard]] std::string line() const { return line_ + "\n"; }

 private:
  void show_number(const Member& /*member*/, std::optional<double> value) override {
    put(value && std::isfinite(*value) ? number_text(*value) : "");
  }
  void show_integer(const Member& /*member*/, std::optional<std::int64_t> value) override {
    put(value ? std::to_string(*value) : "");
  }
  void show_flag(const Member& /*member*/, bool value) override { put(value ? "true" : "false"); }
  // No text of a message has a comma, a quote or a line feed: they are names.
  void show_text(const Member& /*member*/, std::size_t /*bytes*/, std::string_view value) override {
    put(value);
  }
  void put(std::string_view value) {
    if (!first_) line_ += ',';
    first_ = false;
    line_ += value;
  }
  std::string line_;
  bool first_ = true;
};

}  // namespace

const std::vector<FrameColumn>& frame_columns() {
  static const std::vector<FrameColumn> all = [] {
    Describer describer;
    const FrameMessage message;
    describe(message, describer);
    return describer.columns;
  }();
  return all;
}

std::size_t frame_row_bytes() {
  return frame_columns().back().offset + frame_columns().back().bytes;
}

void append_frame_row(const FrameMessage& message, std::string& rows) {
  RowWriter writer(rows);
  describe(message, writer);
}

std::string frame_csv_head() {
  std::string line;
  for (const FrameColumn& column : frame_columns()) {
    if (!line.empty()) line += ',';
    line += column.name;
  }
  return line + "\n";
}

std::string frame_csv_row(const FrameMessage& message) {
  CsvWriter writer;
  describe(message, writer);
  return writer.line();
}

}  // namespace splid
