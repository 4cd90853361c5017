#pragma once

#include <cstddef>
#include <string_view>

namespace splid::view {

// A file of the live page, as it is in the program: compressed by gzip when splid is built.
struct PageAsset {
  const char* path;  // as a browser asks for it, from the page's folder: "" for the page itself
  const char* type;  // Content-Type
  const unsigned char* bytes;
  std::size_t size;
};

// The file that has this path; null: none has.
const PageAsset* find_asset(std::string_view path);

}  // namespace splid::view
