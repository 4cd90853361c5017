#include <filesystem>
#include <fstream>
#include <iostream>
#include <set>

#include "tests/fuzz/fuzz.hpp"

// Runs a fuzz target, built without libFuzzer, over every file of the folder given: its corpus as
// an ordinary test. A file that breaks it ends the process, its name being the last line.
int main(int argc, char** argv) {
  const auto& targets = splid::test::fuzz_targets();
  const auto target = argc == 3 ? targets.find(argv[1]) : targets.end();
  if (target == targets.end()) {
    std::cerr << "usage: fuzz_corpora TARGET FOLDER; targets:";
    for (const auto& [name, run] : targets) std::cerr << ' ' << name;
    std::cerr << '\n';
    return 2;
  }
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[2])) files.insert(entry);
  for (const auto& file : files) {
    std::cout << file.string() << std::endl;
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    target->second(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
  std::cout << files.size() << " files\n";
  return files.empty() ? 1 : 0;
}
