#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "estimator/fold/kernel_choice.hpp"

// The search's kernels by themselves, for an emulator that counts instructions.
//
//   kernel_counts                        a checksum of each kernel's numbers at each vector level;
//                                        exit code 1 where a level gives other bits than generic
//   kernel_counts LEVEL KERNEL ROUNDS    runs one so many times over 4,099 elements
namespace {

using splid::SearchKernels;
using splid::VectorLevel;

constexpr std::size_t count = 4099;  // no multiple of any vector

struct Arrays {
  Arrays() {
    std::mt19937_64 random(1);
    for (std::size_t i = 0; i < count; ++i) {
      in_8.push_back(static_cast<std::uint8_t>(random()));
      in_16.push_back(static_cast<std::uint16_t>(random()));
      in_32.push_back(static_cast<std::uint32_t>(random()));
      rows.push_back(in_32.back() >> 8);
      times.push_back(static_cast<double>(random() >> 11) * 0x1p-20);
      photons_ps.push_back(static_cast<std::int64_t>(random() >> 28));  // 69 ms
    }
    for (std::size_t i = 0; i < count; ++i) {
      half_8.push_back(static_cast<std::uint8_t>(in_8[i] % 127));
      half_16.push_back(static_cast<std::uint16_t>(in_16[i] % 32767));
    }
    half_8.back() = 127;
    half_16.back() = 32767;
    rows.back() = 0xffffff;
    for (std::uint8_t& flag : flags) flag = random() % 16 == 0 ? 1 : 0;
  }
  std::vector<std::uint8_t> in_8;
  std::vector<std::uint16_t> in_16;
  std::vector<std::uint32_t> in_32, rows;
  // Numbers whose sums of two fit into their type. Only the last of them is the largest.
  std::vector<std::uint8_t> half_8;
  std::vector<std::uint16_t> half_16;
  std::vector<double> times;
  std::vector<std::int64_t> photons_ps;
  std::vector<std::uint8_t> flags = std::vector<std::uint8_t>(1 << 12);
  // Where the kernels write.
  std::vector<std::uint8_t> out_8 = std::vector<std::uint8_t>(count, 1);
  std::vector<std::uint16_t> out_16 = std::vector<std::uint16_t>(count, 1);
  std::vector<std::uint32_t> out_32 = std::vector<std::uint32_t>(count, 1);
  std::vector<std::uint8_t> four_8 = std::vector<std::uint8_t>(4 * count, 1);
  std::vector<std::uint16_t> four_16 = std::vector<std::uint16_t>(4 * count, 1);
  std::vector<std::uint32_t> four_32 = std::vector<std::uint32_t>(4 * count, 1);
  std::vector<double> out_ns = std::vector<double>(count), out_phases = out_ns;
  std::uint64_t out = 0;
};

using Run = std::function<void(const SearchKernels&, Arrays&)>;

using Runs = std::map<std::string, Run>;

Runs sums() {
  return {
      {"add_8",
       [](const SearchKernels& by, Arrays& a) {
         by.bytes.add(a.out_8.data(), a.in_8.data(), a.in_8.data(), count);
       }},
      {"add",
       [](const SearchKernels& by, Arrays& a) {
         by.words.add(a.out_16.data(), a.in_16.data(), a.in_16.data(), count);
       }},
      {"add_32",
       [](const SearchKernels& by, Arrays& a) {
         by.longs.add(a.out_32.data(), a.in_32.data(), a.in_32.data(), count);
       }},
      {"add_8_to_16",
       [](const SearchKernels& by, Arrays& a) {
         by.add_8_to_16(a.out_16.data(), a.in_8.data(), a.in_8.data(), count);
       }},
      {"add_16_to_32",
       [](const SearchKernels& by, Arrays& a) {
         by.add_16_to_32(a.out_32.data(), a.in_16.data(), a.in_16.data(), count);
       }},
      {"add_four_8",
       [](const SearchKernels& by, Arrays& a) {
         by.bytes.add_four(a.four_8.data(), count, a.in_8.data(), a.in_8.data(), a.in_8.data(),
                           a.in_8.data(), count - 3);
       }},
      {"add_four",
       [](const SearchKernels& by, Arrays& a) {
         by.words.add_four(a.four_16.data(), count, a.in_16.data(), a.in_16.data(), a.in_16.data(),
                           a.in_16.data(), count - 3);
       }},
      {"add_four_32",
       [](const SearchKernels& by, Arrays& a) {
         by.longs.add_four(a.four_32.data(), count, a.in_32.data(), a.in_32.data(), a.in_32.data(),
                           a.in_32.data(), count - 3);
       }},
      {"accumulate_8",
       [](const SearchKernels& by, Arrays& a) {
         by.bytes.accumulate(a.out_8.data(), a.in_8.data(), count);
       }},
      {"accumulate",
       [](const SearchKernels& by, Arrays& a) {
         by.words.accumulate(a.out_16.data(), a.in_16.data(), count);
       }},
      {"accumulate_32",
       [](const SearchKernels& by, Arrays& a) {
         by.longs.accumulate(a.out_32.data(), a.in_32.data(), count);
       }},
      {"largest_8",
       [](const SearchKernels& by, Arrays& a) { a.out = by.bytes.largest(a.in_8.data(), count); }},
      {"largest",
       [](const SearchKernels& by, Arrays& a) { a.out = by.words.largest(a.in_16.data(), count); }},
      {"first_above_8",
       [](const SearchKernels& by, Arrays& a) {
         a.out = by.bytes.first_above(a.half_8.data(), a.half_8.data(), 1, count, 252);
       }},
      {"first_above",
       [](const SearchKernels& by, Arrays& a) {
         a.out = by.words.first_above(a.half_16.data(), a.half_16.data(), 1, count, 65533);
       }},
      {"first_above_32",
       [](const SearchKernels& by, Arrays& a) {
         a.out = by.longs.first_above(a.rows.data(), a.rows.data(), 1, count, 0x1fffffd);
       }},
  };
}

Runs photons() {
  return {
      {"delay_cells",
       [](const SearchKernels& by, Arrays& a) {
         by.delay_cells(a.out_32.data(), a.rows.data(), a.in_32.data(), 77, count, 3780);
       }},
      {"track_phases",
       [](const SearchKernels& by, Arrays& a) {
         by.track_phases(a.out_32.data(), a.in_32.data(), a.times.data(), 1e6, 0.3, 0, count);
       }},
      {"fold",
       [](const SearchKernels& by, Arrays& a) {
         by.fold(a.out_ns.data(), a.out_phases.data(), a.out_32.data(), a.photons_ps.data(),
                 {1000, 1e-3, 1 / 3.78e6, 0.25, 1e-24, 3780}, count);
       }},
      {"pick",
       [](const SearchKernels& by, Arrays& a) {
         a.out = by.pick(a.out_32.data(), a.in_32.data(), a.flags.data(), 20, count);
       }},
  };
}

const Runs& runs() {
  static const Runs all = [] {
    Runs both = sums();
    both.merge(photons());
    return both;
  }();
  return all;
}

// The FNV-1a hash of a kernel's output.
template <class Value>
void add_to(std::uint64_t& sum, const std::vector<Value>& values) {
  for (const Value& value : values) {
    unsigned char bytes[sizeof(Value)];
    std::memcpy(bytes, &value, sizeof bytes);
    for (const unsigned char byte : bytes) sum = (sum ^ byte) * 0x100000001b3;
  }
}

std::uint64_t checksum(const Run& run, VectorLevel level) {
  Arrays arrays;
  run(splid::search_kernels(level), arrays);
  // Behind the indices that pick() returns, the array may hold anything.
  std::uint64_t sum = 0xcbf29ce484222325 ^ arrays.out;
  if (arrays.out == 0) add_to(sum, arrays.out_32);
  add_to(sum, std::vector(arrays.out_32.begin(),
                          arrays.out_32.begin() + static_cast<std::ptrdiff_t>(arrays.out % count)));
  add_to(sum, arrays.out_8);
  add_to(sum, arrays.out_16);
  add_to(sum, arrays.four_8);
  add_to(sum, arrays.four_16);
  add_to(sum, arrays.four_32);
  add_to(sum, arrays.out_ns);
  add_to(sum, arrays.out_phases);
  return sum;
}

int compare_levels() {
  int code = 0;
  for (const auto& [name, run] : runs()) {
    const std::uint64_t expected = checksum(run, VectorLevel::generic);
    for (const VectorLevel level : splid::runnable_vector_levels()) {
      const std::uint64_t sum = checksum(run, level);
      std::printf("%-13s %-9s %016llx\n", name.c_str(), splid::vector_level_name(level),
                  static_cast<unsigned long long>(sum));
      if (sum != expected) code = 1;
    }
  }
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 1) return compare_levels();
  if (argc != 4 || !runs().contains(argv[2])) return 2;
  for (const VectorLevel level : splid::runnable_vector_levels()) {
    if (std::string(argv[1]) != splid::vector_level_name(level)) continue;
    Arrays arrays;
    for (int round = std::atoi(argv[3]); round > 0; --round) {
      runs().at(argv[2])(splid::search_kernels(level), arrays);
    }
    return 0;
  }
  return 2;
}
