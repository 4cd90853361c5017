#pragma once

namespace splid {

// The program: reads the command line, does what it says and turns errors into a sentence on
// standard error and an exit code (0 done, 2 usage or configuration, 3 device, 4 data).
int run_app(int argc, char** argv);

}  // namespace splid
