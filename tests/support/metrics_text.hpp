#pragma once

#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

namespace splid::test {

// Prometheus' text format, read back.
struct MetricsText {
  // Throws where a line is neither a comment nor `series value`.
  explicit MetricsText(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("# TYPE ")) {
        std::istringstream words(line.substr(7));
        std::string name;
        std::string type;
        words >> name >> type;
        types[name] = type;
      }
      if (line.starts_with("#")) continue;
      const std::size_t space = line.rfind(' ');
      if (space == std::string::npos) throw std::runtime_error("no metric: " + line);
      const std::string series = line.substr(0, space);
      values[series] = std::stod(line.substr(space + 1));
      names.insert(series.substr(0, series.find('{')));
    }
  }

  // Throws where there is none of that name, labels included.
  [[nodiscard]] double operator()(const std::string& series) const { return values.at(series); }

  // Over all labels.
  [[nodiscard]] double sum(const std::string& name) const {
    double sum = 0;
    for (const auto& [series, value] : values) {
      if (series.starts_with(name + "{")) sum += value;
    }
    return sum;
  }

  std::map<std::string, double> values;  // by name and labels
  std::map<std::string, std::string> types;
  std::set<std::string> names;  // of series, with _bucket, _sum and _count
};

}  // namespace splid::test
