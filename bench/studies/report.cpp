#include "bench/studies/report.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "protocol/error.hpp"

namespace splid::studies {
namespace {

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text << std::flush;
  if (!out) {
    throw Error(Fault::device, file.string() + ": cannot be written: " + std::strerror(errno));
  }
}

}  // namespace

void write_report(const std::filesystem::path& folder, const std::filesystem::path& table) {
  const Results results = read_results(folder);
  if (results.empty()) throw Error(Fault::data, folder.string() + ": no results in it");
  const auto beside = [&](const std::string& ending) {
    return table.parent_path() / (table.stem().string() + ending + table.extension().string());
  };
  write_file(table, reader_page(results));
  write_file(beside("-figures"), figures_page(results, "studies"));
  write_file(beside("-beyond"), beyond_page(results, "studies"));
}

}  // namespace splid::studies
