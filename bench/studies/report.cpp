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
  write_file(table, tables(results, "studies"));
}

}  // namespace splid::studies
