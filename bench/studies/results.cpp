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
  std::string name;
  std::function<double&(Result&)> at;
};

void add_values(const std::string& what, const std::vector<const char*>& names,
                AllValues Score::*member, std::vector<Column>& columns) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    columns.push_back(
        {what + names[i], [member, i](Result& r) -> double& { return (r.score.*member)[i]; }});
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
      {"crb_delay_start_ns",
       [](Result& r) -> double& { return r.expectation.bound.delay_start_ns; }},
      {"crb_velocity_mps", [](Result& r) -> double& { return r.expectation.bound.velocity_mps; }},
      {"crb_signal_per_pulse",
       [](Result& r) -> double& { return r.expectation.bound.signal_per_pulse; }},
      {"crb_background_per_ns",
       [](Result& r) -> double& { return r.expectation.bound.background_per_ns; }},
      {"p50_ms", [](Result& r) -> double& { return r.score.p50_ms; }},
      {"p99_ms", [](Result& r) -> double& { return r.score.p99_ms; }},
      {"took_s", [](Result& r) -> double& { return r.score.took_s; }},
  };
  const std::vector<const char*> with_unit = {"delay_ns", "velocity_mps", "signal_per_pulse",
                                              "background_per_ns", "delay_start_ns"};
  add_values("rmse_", with_unit, &Score::rmse, columns);
  add_values("rmse_all_", with_unit, &Score::rmse_all, columns);
  const std::vector<const char*> published = {"delay", "velocity", "signal", "background"};
  add_values("inside_one_", published, &Score::inside_one, columns);
  add_values("inside_two_", published, &Score::inside_two, columns);
  return columns;
}

const std::vector<Column>& columns() {
  static const std::vector<Column> all = make_columns();
  return all;
}

// Columns before columns(): the key's and the counts; after them machine and date.
constexpr const char* first_names =
    "study,mode,effort,length_ms,signal_per_pulse,background_per_ns,velocity_mps,estimator,trials,"
    "no_value,wrong,ambiguous,wrong_ok,with_deviation";
constexpr std::size_t key_fields = 8;
constexpr std::size_t first_fields = 14;
std::string header() {
  std::string line = first_names;
  for (const Column& column : columns()) line += "," + column.name;
  return line + ",machine,date";
}

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
  for (const Effort effort : {Effort::fast, Effort::balanced}) {
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
  if (!std::getline(in, line) || line != header()) {
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
  const Score& score = result.score;
  std::string line = key(result.job);
  for (const int count : {score.trials, score.no_value, score.wrong, score.ambiguous,
                          score.wrong_ok, score.with_deviation}) {
    line += "," + std::to_string(count);
  }
  for (const Column& column : columns()) line += "," + number_text(column.at(copy));
  return line + "," + result.machine + "," + result.date;
}

std::optional<Result> from_csv(const std::string& line) {
  const std::vector<std::string> fields = split(line);
  if (fields.size() != first_fields + columns().size() + 2) return std::nullopt;
  Result result;
  if (!read_job(fields, result.job)) return std::nullopt;
  Score& score = result.score;
  std::size_t at = key_fields;
  for (int* count : {&score.trials, &score.no_value, &score.wrong, &score.ambiguous,
                     &score.wrong_ok, &score.with_deviation}) {
    if (!read_number(fields[at++], *count)) return std::nullopt;
  }
  for (const Column& column : columns()) {
    if (!read_number(fields[at++], column.at(result))) return std::nullopt;
  }
  result.machine = fields[at++];
  result.date = fields[at];
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
