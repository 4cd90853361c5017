#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace splid::test {

// A number of `Number`'s type at an offset in little-endian bytes.
template <class Number>
Number number_at(const std::string& bytes, std::size_t offset) {
  Number number{};
  if (offset + sizeof number > bytes.size()) throw std::out_of_range("bytes end before");
  std::memcpy(&number, bytes.data() + offset, sizeof number);
  return number;
}

}  // namespace splid::test
