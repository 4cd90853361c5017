#pragma once

#include <string>

namespace splid {

// Opens the instrument at a place that `splid devices` lists, counts its tags for some seconds, and
// prints the rate of each input, the period of the syncs, losses, and a configuration that uses it.
// What the instrument reports goes to standard error.
//
// place: BUS:DEV, unix:PATH or tcp:HOST:PORT. Returns the exit code.
//
// Errors: Error(Fault::usage) where it is no place; Error(Fault::device) where nothing is there or
// no tag came; those of the driver.
int try_device(const std::string& place, double seconds);

}  // namespace splid
