#include "bench/studies/results.hpp"

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"

namespace splid::studies {
namespace {

// One number of a result, by name, so that reading and writing cannot differ.
struct Column {
  const char* name;
  std::function<double&(Result&)> at;
};

template <typename Array>
void add_four(const char* const (&names)[values], Array Score::*member,
              std::vector<Column>& columns) {
  for (std::size_t i = 0; i < values; ++i) {
    columns.push_back(
        {names[i], [member, i](Result& r) -> double& { return (r.score.*member)[i]; }});
  }
}

std::vector<Column> make_columns() {
  std::vector<Column> columns = {
      {"frame_ns", [](Result& r) -> double& { return r.expectation.length_ns; }},
      {"signal_photons", [](Result& r) -> double& { return r.expectation.signal_photons; }},
      {"background_photons", [](Result& r) -> double& { return r.expectation.background_photons; }},
      {"gain_nats", [](Result& r) -> double& { return r.expectation.gain_nats; }},
      {"gain_std_nats", [](Result& r) -> double& { return r.expectation.gain_deviation_nats; }},
      {"threshold_nats", [](Result& r) -> double& { return r.expectation.threshold_nats; }},
      {"chance_lost", [](Result& r) -> double& { return r.expectation.chance_lost; }},
      {"crb_delay_ns", [](Result& r) -> double& { return r.expectation.bound.delay_ns; }},
      {"crb_velocity_mps", [](Result& r) -> double& { return r.expectation.bound.velocity_mps; }},
      {"crb_signal_per_pulse",
       [](Result& r) -> double& { return r.expectation.bound.signal_per_pulse; }},
      {"crb_background_per_ns",
       [](Result& r) -> double& { return r.expectation.bound.background_per_ns; }},
      {"p50_ms", [](Result& r) -> double& { return r.score.p50_ms; }},
      {"p99_ms", [](Result& r) -> double& { return r.score.p99_ms; }},
  };
  add_four(
      {"rmse_delay_ns", "rmse_velocity_mps", "rmse_signal_per_pulse", "rmse_background_per_ns"},
      &Score::rmse, columns);
  add_four(
      {"inside_one_delay", "inside_one_velocity", "inside_one_signal", "inside_one_background"},
      &Score::inside_one, columns);
  add_four(
      {"inside_two_delay", "inside_two_velocity", "inside_two_signal", "inside_two_background"},
      &Score::inside_two, columns);
  return columns;
}

const std::vector<Column>& columns() {
  static const std::vector<Column> all = make_columns();
  return all;
}

// Columns before columns(): the key's and the counts; after them machine and date.
constexpr const char* first_names =
    "study,mode,effort,length_ms,signal_per_pulse,background_per_ns,velocity_mps,estimator,trials,"
    "no_value,wrong,with_deviation";
constexpr std::size_t key_fields = 8;
constexpr std::size_t first_fields = 12;
// What results of before the odds of the range do not have.
constexpr const char* odds_names = ",ambiguous,wrong_ok";
constexpr std::size_t odds_fields = 2;

std::string header_without_odds() {
  std::string line = first_names;
  for (const Column& column : columns()) line += std::string(",") + column.name;
  return line + ",machine,date";
}

std::string header() { return header_without_odds() + odds_names; }

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

template <typename Number>
bool read_number(const std::string& text, Number& number) {
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number);
  return read.ec == std::errc() && read.ptr == end;
}

std::optional<Effort> effort_from_name(const std::string& name) {
  for (const Effort effort : {Effort::fast, Effort::balanced, Effort::exhaustive}) {
    if (splid::to_string(effort) == name) return effort;
  }
  return std::nullopt;
}

bool read_job(const std::vector<std::string>& fields, Job& job) {
  const auto study = study_from_name(fields[0]);
  const auto mode = mode_from_string(fields[1]);
  const auto effort = effort_from_name(fields[2]);
  const auto estimator = estimator_from_name(fields[7]);
  if (!study || !mode || !effort || !estimator) return false;
  job.cell.study = *study;
  job.cell.mode = *mode;
  job.cell.effort = *effort;
  job.estimator = *estimator;
  double velocity_mps = 0;
  const bool any = fields[6] == "any";
  if (!any && !read_number(fields[6], velocity_mps)) return false;
  if (!any) job.cell.velocity_mps = velocity_mps;
  return read_number(fields[3], job.cell.length_ms) &&
         read_number(fields[4], job.cell.signal_per_pulse) &&
         read_number(fields[5], job.cell.background_per_ns) && read_number(fields[8], job.trials);
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
  throw Error(Fault::data, file.string() + ": " + why);
}

void read_file_into(const std::filesystem::path& file, Results& results) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line) || (line != header() && line != header_without_odds())) {
    refuse(file, "line 1 is not the header of this program's results; move the file away");
  }
  for (int number = 2; std::getline(in, line); ++number) {
    if (in.eof()) break;  // no line end: cut off
    const std::optional<Result> result = from_csv(line);
    if (!result) refuse(file, "line " + std::to_string(number) + " is no result");
    Result& kept = results[key(result->job)];
    if (kept.score.trials <= result->score.trials) kept = *result;
  }
}

}  // namespace

std::string to_csv(const Result& result) {
  Result copy = result;  // the columns give places to read into
  std::string line = key(result.job) + "," + std::to_string(result.score.trials) + "," +
                     std::to_string(result.score.no_value) + "," +
                     std::to_string(result.score.wrong) + "," +
                     std::to_string(result.score.with_deviation);
  for (const Column& column : columns()) line += "," + number_text(column.at(copy));
  return line + "," + result.machine + "," + result.date + "," +
         std::to_string(result.score.ambiguous) + "," + std::to_string(result.score.wrong_ok);
}

std::optional<Result> from_csv(const std::string& line) {
  const std::vector<std::string> fields = split(line);
  const std::size_t fields_without_odds = first_fields + columns().size() + 2;
  const bool has_odds = fields.size() == fields_without_odds + odds_fields;
  if (!has_odds && fields.size() != fields_without_odds) return std::nullopt;
  Result result;
  if (!read_job(fields, result.job)) return std::nullopt;
  result.score.trials = result.job.trials;
  if (!read_number(fields[key_fields + 1], result.score.no_value) ||
      !read_number(fields[key_fields + 2], result.score.wrong) ||
      !read_number(fields[key_fields + 3], result.score.with_deviation)) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < columns().size(); ++i) {
    if (!read_number(fields[first_fields + i], columns()[i].at(result))) return std::nullopt;
  }
  result.machine = fields[fields_without_odds - 2];
  result.date = fields[fields_without_odds - 1];
  if (has_odds && (!read_number(fields[fields_without_odds], result.score.ambiguous) ||
                   !read_number(fields[fields_without_odds + 1], result.score.wrong_ok))) {
    return std::nullopt;
  }
  return result;
}

Results read_results(const std::filesystem::path& folder) {
  Results results;
  if (!std::filesystem::exists(folder)) return results;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") read_file_into(entry.path(), results);
  }
  return results;
}

ResultFile::ResultFile(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream in(file_, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::size_t whole = text.rfind('\n') + 1;  // npos + 1 is 0
  if (whole < text.size()) std::filesystem::resize_file(file_, whole);
  if (whole > 0) return;
  std::ofstream out(file_);
  out << header() << std::endl;
  if (!out) {
    throw Error(Fault::device, file_.string() + ": cannot be written: " + std::strerror(errno));
  }
}

void ResultFile::append(const Result& result) const {
  std::ofstream out(file_, std::ios::app);
  out << to_csv(result) + "\n" << std::flush;
  if (!out) {
    throw Error(Fault::device, file_.string() + ": cannot be written: " + std::strerror(errno));
  }
}

std::string machine_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("model name")) continue;
    std::string name = line.substr(std::min(line.size(), line.find(':') + 2));
    std::replace(name.begin(), name.end(), ',', ' ');
    return name;
  }
  return "unknown processor";
}

std::string today_utc() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &parts);
  return text;
}

}  // namespace splid::studies
