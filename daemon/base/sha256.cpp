#include "daemon/base/sha256.hpp"

#include <openssl/evp.h>

#include <array>
#include <cstddef>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

namespace splid {
namespace {

constexpr std::size_t hashed_at_once = 1 << 20;

std::string hexadecimal(const unsigned char* bytes, std::size_t count) {
  constexpr std::array digits = {'0', '1', '2', '3', '4', '5', '6', '7',
                                 '8', '9', 'a', 'b', 'c', 'd', 'e', 'f'};
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    text += digits.at(bytes[i] >> 4U);
    text += digits.at(bytes[i] & 0xFU);
  }
  return text;
}

}  // namespace

std::optional<std::string> sha256_of_file(const std::string& file, const std::stop_token& stop) {
  std::ifstream in(file, std::ios::binary);
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> hash(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  if (!hash || EVP_DigestInit_ex(hash.get(), EVP_sha256(), nullptr) != 1) return std::nullopt;
  std::vector<char> block(hashed_at_once);
  while (in && !stop.stop_requested()) {
    in.read(block.data(), static_cast<std::streamsize>(block.size()));
    EVP_DigestUpdate(hash.get(), block.data(), static_cast<std::size_t>(in.gcount()));
  }
  if (!in.eof()) return std::nullopt;
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int bytes = 0;
  if (EVP_DigestFinal_ex(hash.get(), digest.data(), &bytes) != 1) return std::nullopt;
  return hexadecimal(digest.data(), bytes);
}

std::string sha256_of(std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int bytes = 0;
  if (EVP_Digest(text.data(), text.size(), digest.data(), &bytes, EVP_sha256(), nullptr) != 1) {
    throw std::runtime_error("the SHA-256 of a text cannot be computed; is memory full?");
  }
  return hexadecimal(digest.data(), bytes);
}

}  // namespace splid
