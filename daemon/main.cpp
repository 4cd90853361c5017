#include "daemon/commands/commands.hpp"

int main(int argc, char** argv) { return splid::run_app(argc, argv); }
