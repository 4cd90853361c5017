#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/tag.hpp"

// What all fuzz targets share: any bytes are an input. must() checks what has to hold for every
// input, and ends the process where it does not, as libFuzzer wants it.

// SPLID_FUZZ_TARGET(NAME) { ... return 0; } tries one input: data, and its size in bytes. With
// libFuzzer each target is a program; without, one program has all of them and is told which one to
// run over its corpus.
#ifdef SPLID_LIBFUZZER
#define SPLID_FUZZ_TARGET(name) \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
#else
#define SPLID_FUZZ_TARGET(name)                                                                 \
  static int try_##name(const std::uint8_t* data, std::size_t size);                            \
  static const bool has_##name = splid::test::fuzz_targets().emplace(#name, try_##name).second; \
  static int try_##name(const std::uint8_t* data, std::size_t size)
#endif

namespace splid::test {

using FuzzTarget = int (*)(const std::uint8_t* data, std::size_t size);

// By name; each target puts itself in before main() begins.
inline std::map<std::string, FuzzTarget>& fuzz_targets() {
  static std::map<std::string, FuzzTarget> targets;
  return targets;
}

inline void must(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

// The input as values, one taken after the other; zeros once it is used up.
class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* data, std::size_t size)
      : left_(std::as_bytes(std::span(data, size))) {}

  [[nodiscard]] bool empty() const { return left_.empty(); }

  // Little endian, as many bytes as the type has.
  template <class Number>
  Number take() {
    static_assert(std::is_integral_v<Number>);
    std::uint64_t value = 0;
    const std::size_t count = std::min(sizeof(Number), left_.size());
    for (std::size_t i = 0; i < count; ++i) {
      value |= std::to_integer<std::uint64_t>(left_[i]) << (8 * i);
    }
    left_ = left_.subspan(count);
    return static_cast<Number>(value);
  }

  // 0 to most.
  std::size_t below_or(std::size_t most) { return take<std::uint16_t>() % (most + 1); }

  std::span<const std::byte> take_bytes(std::size_t count) {
    const auto taken = left_.first(std::min(count, left_.size()));
    left_ = left_.subspan(taken.size());
    return taken;
  }
  std::span<const std::byte> rest() { return take_bytes(left_.size()); }

 private:
  std::span<const std::byte> left_;
};

inline std::string as_text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// Runs a parser, which may refuse its input in one way alone: an Error of the fault that its
// documentation names, with a sentence. False where it did.
template <class Parse>
bool accepts(Fault fault, Parse parse) {
  try {
    parse();
    return true;
  } catch (const Error& error) {
    must(error.fault() == fault, "an error has the fault that is documented");
    must(std::strlen(error.what()) > 0, "an error says what is wrong");
    return false;
  }
}

// Any tag stream that a source could hand on, out of few bytes: mostly small steps of time, with
// jumps and times anywhere in 64 bits among them.
class FuzzTags {
 public:
  explicit FuzzTags(FuzzInput& input) : input_(input) {}

  Tag next() {
    const auto head = input_.take<std::uint8_t>();
    step(head >> 4U);
    Tag tag{now_ps_, 0, static_cast<TagKind>(head & 7U), {}};
    if (tag.kind == TagKind::photon) {
      tag.value = (head & 8U) != 0 ? input_.take<std::int8_t>() : 1;
    } else if (tag.kind == TagKind::marker) {
      tag.value = (head & 8U) != 0 ? 1 + input_.take<std::uint8_t>() % 15 : 1;
    } else if (tag.kind == TagKind::loss_end || tag.kind == TagKind::missed) {
      tag.value = (head & 8U) != 0 ? std::max(input_.take<std::int32_t>(), -1) : 3;
    }
    return tag;
  }

 private:
  // Unsigned: times wrap around at the ends of 64 bits.
  void step(unsigned how) {
    auto now = static_cast<std::uint64_t>(now_ps_);
    if (how < 8) {
      now += std::uint64_t{input_.take<std::uint8_t>()} << (5U * how);  // up to 9 s
    } else if (how < 13) {
      now -= std::uint64_t{input_.take<std::uint8_t>()} << (8U * (how - 8U));
    } else if (how == 13) {
      now += 100'000'000;  // a pattern period
    } else if (how == 14) {
      now += static_cast<std::uint64_t>(std::int64_t{input_.take<std::int32_t>()});
    } else {
      now = input_.take<std::uint64_t>();
    }
    now_ps_ = static_cast<std::int64_t>(now);
  }

  FuzzInput& input_;
  std::int64_t now_ps_ = 0;
};

inline std::vector<Tag> fuzz_tags(FuzzInput& input, std::size_t most = 100'000) {
  std::vector<Tag> tags;
  FuzzTags source(input);
  while (!input.empty() && tags.size() < most) tags.push_back(source.next());
  return tags;
}

}  // namespace splid::test
