#pragma once

#include <string>

#include "protocol/error.hpp"

namespace splid::test {

// What the Error thrown by `call` says; empty where it throws none.
template <class Call>
std::string error_text(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace splid::test
