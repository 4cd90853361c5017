#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

namespace splid {

// The SHA-256 of a file as 64 hexadecimal digits, like that of sha256sum. Absent after a stop
// request and where the file cannot be read to its end.
//
// Threads: any. Timeouts: a stop request is seen within a mebibyte. Errors: none.
std::optional<std::string> sha256_of_file(const std::string& file, const std::stop_token& stop);

// The SHA-256 of a text as 64 hexadecimal digits. Threads: any. Errors: std::runtime_error where
// the library fails, which only a lack of memory can bring about.
std::string sha256_of(std::string_view text);

}  // namespace splid
