#pragma once

#include "config/config.hpp"

namespace splid {

// What `run` has in memory once frames flow, MiB of 2^20 bytes: the ring, the recording's ring, the
// line of a scan that frame.by names, the frames of the lanes, the estimators and the program
// itself. More where a reload makes estimators anew, for frames of many photons, and where only the
// source tells of a scan.
//
// Design note: rings, frames and the tables of the search are what they are allocated as. The
// program's 17 MiB and the 2 MiB of the rest of an estimator are fitted to what the process has.
double memory_needed_mib(const Config& config);

// Has the C library give large blocks back to the system as soon as they are freed, for the whole
// process. Before the first thread.
//
// Design note: glibc raises the size from which blocks are mappings of their own, 128 KiB, to that
// of the largest freed so far. The buffers of a reload's estimators then come from its heaps, where
// they leave holes: 60 reloads of two estimators grew the daemon from 35 to 127 MiB, and with the
// size held it stays below 47.
void return_large_blocks();

}  // namespace splid
