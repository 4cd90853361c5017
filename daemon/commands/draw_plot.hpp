#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace splid {

// Has Python draw a picture: `python3 -m splid.plots ARGUMENTS`, of which the last is the picture.
// The splid module is looked for where Python looks, and in the folder in which this program was
// built. Returns why nothing was drawn, and where Python or the module is missing which command
// draws it later; absent where it was drawn.
//
// Threads: any. Errors: none.
std::optional<Error> try_to_draw(const std::vector<std::string>& arguments);

// The same, and logs what came of it: what was measured is in its tables.
void draw_plot(const std::vector<std::string>& arguments);

// The table that a picture is drawn of, where the user named none: its name with .csv.
std::string table_of_plot(const std::string& picture);

}  // namespace splid
