#include "daemon/commands/app.hpp"

int main(int argc, char** argv) { return splid::run_app(argc, argv); }
