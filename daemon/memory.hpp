#pragma once

namespace splid {

// Has the C library give large blocks back to the system as soon as they are freed, for the whole
// process. Before the first thread.
//
// Design note: glibc raises the size from which blocks are mappings of their own, 128 KiB, to that
// of the largest freed so far. The buffers of a reload's estimators then come from its heaps, where
// they leave holes: 60 reloads of two estimators grew the daemon from 35 to 127 MiB, and with the
// size held it stays below 47.
void return_large_blocks();

}  // namespace splid
