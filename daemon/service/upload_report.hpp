#pragma once

#include <string>

#include "daemon/base/text.hpp"
#include "drivers/awg/upload.hpp"

namespace splid {

// What an upload came to, for people.
inline std::string in_words(const Uploaded& uploaded) {
  return uploaded.instrument + ": plays " + describe_pattern(uploaded.played) +
         "; its error queue is empty";
}

}  // namespace splid
