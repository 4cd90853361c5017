#include <filesystem>
#include <fstream>
#include <iostream>
#include <set>

#include "tests/fuzz/fuzz.hpp"

// Runs a fuzz target, built without libFuzzer, over every file of the folder given: its corpus as
// an ordinary test. A file that breaks it ends the process, its name being the last line.
int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: fuzz_NAME FOLDER\n";
    return 2;
  }
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) files.insert(entry);
  for (const auto& file : files) {
    std::cout << file.string() << std::endl;
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
  std::cout << files.size() << " files\n";
  return files.empty() ? 1 : 0;
}
