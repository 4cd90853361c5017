#include "daemon/study/tradeoff/tradeoff_table.hpp"

#include <charconv>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>

#include "protocol/error.hpp"

namespace splid::tradeoff {
namespace {

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char character : line) {
    if (character == ',') {
      fields.emplace_back();
    } else {
      fields.back() += character;
    }
  }
  return fields;
}

// A line of a table, whose fields are asked for by their columns' names.
class TableLine {
 public:
  TableLine(std::string place, const std::vector<std::string>& names, const std::string& line)
      : place_(std::move(place)) {
    const std::vector<std::string> fields = fields_of(line);
    if (fields.size() != names.size()) {
      refuse("has " + std::to_string(fields.size()) + " fields below " +
             std::to_string(names.size()) + " names");
    }
    for (std::size_t i = 0; i < names.size(); ++i) fields_[names[i]] = fields[i];
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Fault::data, place_ + ": " + what + "; a table of splid tradeoff is expected");
  }

  [[nodiscard]] const std::string& text(const std::string& name) const {
    const auto found = fields_.find(name);
    if (found == fields_.end()) refuse("there is no column " + name);
    return found->second;
  }

  // Absent where the field is empty.
  [[nodiscard]] std::optional<double> value(const std::string& name) const {
    const std::string& field = text(name);
    if (field.empty()) return std::nullopt;
    double value = 0;
    const char* end = field.data() + field.size();
    const auto read = std::from_chars(field.data(), end, value);
    if (read.ec != std::errc() || read.ptr != end) refuse(name + " is '" + field + "', no number");
    return value;
  }

  [[nodiscard]] double number(const std::string& name) const {
    const auto found = value(name);
    if (!found) refuse(name + " is empty");
    return *found;
  }

  [[nodiscard]] std::optional<Interval> interval(const std::string& low,
                                                 const std::string& high) const {
    const auto first = value(low);
    const auto last = value(high);
    return first && last ? std::optional(Interval{*first, *last}) : std::nullopt;
  }

  [[nodiscard]] std::size_t count(const std::string& name) const {
    const double found = number(name);
    if (!(found >= 0 && found < 1e15)) refuse(name + " is no number of frames");
    return static_cast<std::size_t>(found);
  }

  template <class Choice>
  [[nodiscard]] Choice choice(const std::string& name,
                              std::initializer_list<std::pair<const char*, Choice>> all) const {
    const std::string& field = text(name);
    for (const auto& [word, choice] : all) {
      if (field == word) return choice;
    }
    refuse(name + " is '" + field + "'");
  }

 private:
  std::string place_;
  std::map<std::string, std::string> fields_;
};

Row row_of(const TableLine& line, const Report& report) {
  if (line.text("reference") != name_of(report.reference)) {
    line.refuse("its errors were measured against '" + line.text("reference") + "' and not '" +
                name_of(report.reference) + "'");
  }
  Row row;
  EstimatorOptions& estimator = row.setting.estimator;
  estimator = report.configured;
  estimator.method =
      line.choice<Method>("method", {{"search", Method::search}, {"paper", Method::paper}});
  estimator.effort =
      line.choice<Effort>("effort", {{"balanced", Effort::balanced}, {"fast", Effort::fast}});
  estimator.findings = line.choice<FindingsWanted>(
      "findings", {{"on", FindingsWanted::on}, {"off", FindingsWanted::off}});
  estimator.tracked = line.choice<bool>("tracked", {{"true", true}, {"false", false}});
  row.setting.length_ms = line.number("length_ms");
  row.frames = line.count("frames");
  row.photons = line.number("photons");
  row.p50_ms = line.number("compute_ms_p50");
  row.p99_ms = line.number("compute_ms_p99");
  row.compared = line.count("compared");
  row.wrong_peaks = line.count("wrong_peaks");
  row.no_value = line.count("no_value");
  row.distance_rmse_m = line.value("distance_rmse_m");
  row.distance_bound_m = line.value("distance_bound_m");
  row.velocity_rmse_mps = line.value("velocity_rmse_mps");
  row.velocity_bound_mps = line.value("velocity_bound_mps");
  row.distance_interval_m = line.interval("distance_rmse_low_m", "distance_rmse_high_m");
  row.velocity_interval_mps = line.interval("velocity_rmse_low_mps", "velocity_rmse_high_mps");
  return row;
}

}  // namespace

std::string to_csv(const Report& report) {
  std::string names;
  std::string lines;
  const auto chosen = chosen_row(report);
  for (std::size_t i = 0; i < report.rows.size(); ++i) {
    for (const Member& member : row_members(report, i)) {
      if (i == 0) names += std::string(member.name) + ",";
      lines += member.plain() + ",";
    }
    lines += chosen == i ? "true\n" : "false\n";
  }
  if (!names.empty()) names += "chosen\n";
  return names + lines;
}

std::vector<Row> rows_of_csv(const std::string& text, const std::string& file,
                             const Report& report) {
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> names = fields_of(line);
  std::vector<Row> rows;
  for (std::size_t number = 2; std::getline(lines, line); ++number) {
    rows.push_back(row_of({file + ", line " + std::to_string(number), names, line}, report));
  }
  return rows;
}

}  // namespace splid::tradeoff
