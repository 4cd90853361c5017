#pragma once

#include <string>
#include <vector>

namespace splid {

// Has Python draw a picture: `python3 -m splid.plots ARGUMENTS`, of which the last is the picture.
// The splid module is looked for where Python looks, and in the folder in which this program was
// built. Where nothing can be drawn, a warning says why and which command draws it later: what was
// measured is in its tables.
//
// Threads: any. Errors: none.
void draw_plot(const std::vector<std::string>& arguments);

// The table that a picture is drawn of, where the user named none: its name with .csv.
std::string table_of_plot(const std::string& picture);

}  // namespace splid
