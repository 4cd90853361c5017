#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "protocol/recording_header.hpp"

namespace splid {

// The headers of PicoQuant's recordings before PTU: PicoHarp 300 (.pt2, .pt3, format version 2.0)
// and HydraHarp 400 (.ht2, .ht3, format versions 1.0 and 2.0). Their records are those of a PTU.
// The creation time is local, of a place that nothing names, so that it stays a text, "FileTime".
//
// Sources: PicoQuant's demonstrations of reading .pt2, .pt3, .ht2 and .ht3.
//
// As parse_ptu_header(). Errors: Error(Fault::data) with the byte offset, for a cut header, another
// version, a file without single photons and values that make no sense.
std::optional<RecordingHeader> parse_pico_harp_header(std::span<const std::byte> prefix,
                                                      bool complete);
std::optional<RecordingHeader> parse_hydra_harp_header(std::span<const std::byte> prefix,
                                                       bool complete);

}  // namespace splid
