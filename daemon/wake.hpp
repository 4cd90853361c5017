#pragma once

#include "drivers/wake.hpp"  // drivers sleep on it too
