#pragma once

#include <string>

#include "protocol/frame_json.hpp"

namespace splid::view {

// What the light of a frame, or of one of its targets, surely has against the configured pulse and
// a straight path, as "pulse 38 % wider, dark for 20 %"; empty where it has nothing. The live page
// has the same words (daemon/view/page/view.js).
//
// Threads: any. Errors: none.
[[nodiscard]] std::string misfits_in_words(const FrameMessage& frame);
[[nodiscard]] std::string misfits_in_words(const FrameMessage::Target& target);

}  // namespace splid::view
